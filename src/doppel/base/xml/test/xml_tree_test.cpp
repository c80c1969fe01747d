#include "doppel/base/xml/xml_tree.h"

#include <gtest/gtest.h>

#include "doppel/description/xacro/xacro.h"

namespace doppel {
namespace {

XacroResult expanded(const std::string& body) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  return expand_xacro(
      parse_xml_tree("<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n" + body + "</robot>",
                     "arm.xacro"),
      "arm.xacro", {}, resolver, diagnostics);
}

const XmlNode& named(const XmlNode& node, const std::string& name) {
  for (const XmlNode& child : node.children) {
    if (child.name == name) return child;
    if (const XmlNode& found = named(child, name); found.name == name) return found;
  }
  return node;
}

TEST(XmlTree, TreeOutlivesText) {
  XmlTree tree;
  {
    std::string text = "<a b='one'>two &amp; three</a>";
    tree = parse_xml_tree(text, "f.xml");
    text.assign(text.size(), 'x');
  }
  const XmlNode node = tree.node();
  EXPECT_EQ(node.find("b")->value, "one");
  EXPECT_EQ(node.content(), "two & three");
}

// What contains no xacro is not copied, so its locations are those of the call that it is now in.
TEST(XmlTree, SharedNodesHaveCallPlaces) {
  const XacroResult result = expanded(
      "<xacro:macro name=\"m\" params=\"n *b\">\n"
      " <l><i><deep v=\"1\"/></i><xacro:insert_block name=\"b\"/></l>\n"
      "</xacro:macro>\n"
      "<xacro:m n=\"1\"><given w=\"2\"/></xacro:m>\n"
      "<xacro:m n=\"2\"><other w=\"2\"/></xacro:m>\n");
  const XmlNode root = result.tree.node();
  EXPECT_EQ(named(root, "deep").where.str(), "arm.xacro:5:1: in macro 'm' (arm.xacro:3:8)");
  EXPECT_EQ(named(root, "deep").find("v")->where.str(), "arm.xacro:5:1: in macro 'm' (arm.xacro:3:14)");
  EXPECT_EQ(named(root, "given").where.str(), "arm.xacro:5:16")
      << "expected the caller's location, not the macro's";
  EXPECT_EQ(named(root, "other").find("w")->where.str(), "arm.xacro:6:23");
}

TEST(XmlTree, AddedAttributeStaysInOneCall) {
  const XacroResult result = expanded(
      "<xacro:macro name=\"m\" params=\"n\">"
      "<l a=\"1\"><xacro:if value=\"${n == 1}\"><x/></xacro:if><xacro:attribute name=\"a\" value=\"${n}\"/>"
      "<xacro:attribute name=\"b\" value=\"${n}\"/></l></xacro:macro>"
      "<xacro:m n=\"1\"/><xacro:m n=\"2\"/>");
  const XmlNode root = result.tree.node();
  std::vector<std::string> seen;
  for (const XmlNode& child : root.children) {
    if (child.name == "l") seen.push_back(child.find("a")->value + child.find("b")->value);
  }
  EXPECT_EQ(seen, (std::vector<std::string>{"11", "22"}));
}

// Shared nodes count like copied ones.
TEST(XmlTree, SharingIsBounded) {
  std::string big = "<g>";
  for (int i = 0; i < 1000; ++i) big += "<h/>";
  big += "</g>";
  std::string text = "<xacro:macro name=\"m0\">" + big + "</xacro:macro>";
  for (int i = 1; i < 12; ++i) {
    const std::string call = "<xacro:m" + std::to_string(i - 1) + "/>";
    text += "<xacro:macro name=\"m" + std::to_string(i) + "\">" + call + call + "</xacro:macro>";
  }
  try {
    expanded(text + "<xacro:m11/>");
    FAIL() << "expected an error: the expansion has two million elements";
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics().front().rule, "xacro.too_much");
  }
}

}  // namespace
}  // namespace doppel
