#include "doppel/description/xacro/xacro.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

// The expansion of `body` inside <robot>, as XML without its declaration and root; or the full text of the
// error.
std::string expanded_robot(const std::string& body,
                           const std::vector<std::pair<std::string, std::string>>& arguments = {}) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  try {
    XmlTree tree = parse_xml_tree(
        "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n" + body + "</robot>", "arm.xacro",
        XmlContent::content);
    const XacroResult result = expand_xacro(std::move(tree), "arm.xacro", arguments, resolver, diagnostics);
    const XmlNode root = result.tree.node();
    std::string out;
    for (const XmlNode& child : root.children) {
      if (child.kind == XmlNode::Kind::element)
        out += to_xml(child).substr(std::string("<?xml version=\"1.0\" ?>\n").size());
    }
    return out;
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(Xacro, PropertiesAreLazyAndKeepTypes) {
  EXPECT_EQ(expanded_robot("<xacro:property name=\"a\" value=\"${b * 2}\"/><xacro:property name=\"b\" "
                           "value=\"3\"/><l x=\"${a}\" y=\"${b}0\" z=\"$${b}\"/>"),
            "<l x=\"6\" y=\"30\" z=\"${b}\"/>\n");
}

// A default is evaluated where the macro is called, so the other parameters are not visible to it.
TEST(Xacro, MacrosTakeDefaultsForwardsAndBlocks) {
  const std::string macro =
      "<xacro:macro name=\"m\" params=\"a b:='x y' c:=${a * 2} d:=^|9 *origin **rest\">"
      "<l a=\"${a}\" b=\"${b}\" c=\"${c}\" d=\"${d}\"><xacro:insert_block "
      "name=\"origin\"/><xacro:insert_block name=\"rest\"/></l></xacro:macro>";
  EXPECT_EQ(expanded_robot(macro +
                           "<xacro:property name=\"d\" value=\"4\"/><xacro:property name=\"a\" value=\"1\"/>"
                           "<xacro:m a=\"5\"><o/><all><p/><q/></all></xacro:m>"),
            "<l a=\"5\" b=\"x y\" c=\"2\" d=\"4\">\n  <o/>\n  <p/>\n  <q/>\n</l>\n");
}

TEST(Xacro, ConditionsTakeLiteralsAndExpressions) {
  EXPECT_EQ(expanded_robot("<xacro:arg name=\"sim\" default=\"false\"/><xacro:if value=\"$(arg "
                           "sim)\"><a/></xacro:if><xacro:unless value=\"$(arg sim)\"><b/></xacro:unless>"),
            "<b/>\n");
  EXPECT_EQ(expanded_robot(
                "<xacro:arg name=\"sim\" default=\"false\"/><xacro:if value=\"$(arg sim)\"><a/></xacro:if>",
                {{"sim", "true"}}),
            "<a/>\n");
  EXPECT_NE(expanded_robot("<xacro:if value=\"maybe\"><a/></xacro:if>").find("not a boolean"),
            std::string::npos);
}

TEST(Xacro, ErrorsListPathAndNearestName) {
  const std::string text = expanded_robot(
      "<xacro:property name=\"length\" value=\"1\"/>\n"
      "<xacro:macro name=\"servo\" params=\"\">\n  <l x=\"${lenght}\"/>\n</xacro:macro>\n<xacro:servo/>\n");
  EXPECT_EQ(text.find("arm.xacro:6:1: in macro 'servo' (arm.xacro:4:6): error: name 'lenght' is not defined; "
                      "did you mean 'length'?"),
            0u)
      << text;
  EXPECT_NE(expanded_robot("<xacro:servo_jiont/><xacro:macro name=\"servo_joint\" params=\"\"/>")
                .find("unknown macro"),
            std::string::npos);
  EXPECT_NE(expanded_robot("<xacro:macro name=\"m\" params=\"width\"/><xacro:m widht=\"1\"/>")
                .find("did you mean 'width'"),
            std::string::npos);
  EXPECT_NE(expanded_robot("<a b=\"$(arg nothing)\"/>").find("undefined substitution argument 'nothing'"),
            std::string::npos);
  EXPECT_NE(
      expanded_robot("<a b=\"$(find no_such_package)\"/>").find("package 'no_such_package' is not found"),
      std::string::npos);
}

TEST(Xacro, EndlessRecursionEnds) {
  EXPECT_NE(expanded_robot("<xacro:macro name=\"m\" params=\"\"><xacro:m/></xacro:macro><xacro:m/>")
                .find("nested more than"),
            std::string::npos);
  EXPECT_NE(expanded_robot("<xacro:property name=\"a\" value=\"${b}\"/><xacro:property name=\"b\" "
                           "value=\"${a}\"/><l x=\"${a}\"/>")
                .find("depends on itself"),
            std::string::npos);
  std::string doubling = "<xacro:macro name=\"m0\" params=\"\"><l/></xacro:macro>";
  for (int i = 1; i <= 60; ++i) {
    doubling += "<xacro:macro name=\"m" + std::to_string(i) + "\" params=\"\"><xacro:m" +
                std::to_string(i - 1) + "/><xacro:m" + std::to_string(i - 1) + "/></xacro:macro>";
  }
  EXPECT_NE(expanded_robot(doubling + "<xacro:m60/>").find("grows without bound"), std::string::npos);
}

// Regression: an arm disappeared without a diagnostic, because '00' was read as 0 and the condition did not
// hold.
TEST(Xacro, QuotedLiteralInCallStaysText) {
  const std::string arm =
      "<xacro:macro name=\"arm\" params=\"version\"><xacro:if value=\"${version == '00'}\"><link "
      "name=\"arm\"/></xacro:if><note v=\"${version}\"/></xacro:macro>";
  EXPECT_EQ(expanded_robot(arm + "<xacro:arm version=\"'00'\"/>"),
            "<link name=\"arm\"/>\n<note v=\"00\"/>\n");
  EXPECT_EQ(expanded_robot(arm + "<xacro:arm version=\"'1.50'\"/>"), "<note v=\"1.50\"/>\n");
  EXPECT_EQ(expanded_robot(arm + "<xacro:arm version=\"'true'\"/>"), "<note v=\"true\"/>\n");
  EXPECT_EQ(expanded_robot(arm + "<xacro:arm version=\"1.50\"/>"), "<note v=\"1.5\"/>\n");
}

TEST(Xacro, QuoteInQuotedDefaultIsKept) {
  EXPECT_EQ(
      expanded_robot("<xacro:macro name=\"m\" params=\"p:='a'b' q\"><l p=\"${p}\" q=\"${q}\"/></xacro:macro>"
                     "<xacro:m q=\"1\"/>"),
      "<l p=\"a'b\" q=\"1\"/>\n");
  EXPECT_NE(expanded_robot("<xacro:macro name=\"m\" params=\"p:='a b\"/>").find("no closing quote"),
            std::string::npos);
}

TEST(Xacro, PropertyOfOtherScopeIsLocalAndLazy) {
  EXPECT_EQ(
      expanded_robot("<xacro:property name=\"p\" value=\"${q}\" scope=\"local\"/><xacro:property name=\"q\" "
                     "value=\"2\"/><l v=\"${p}\"/>"),
      "<l v=\"2\"/>\n");
}

// As in ros/xacro: built-in names count as defined already.
TEST(Xacro, DefaultDoesNotReplaceBuiltIn) {
  EXPECT_EQ(expanded_robot("<xacro:property name=\"tau\" default=\"5\"/><l v=\"${tau}\"/>"),
            "<l v=\"6.283185307179586\"/>\n");
}

TEST(Xacro, DollarWithoutBracketIsRefusedAsByReference) {
  EXPECT_NE(expanded_robot("<l v=\"a$$b\"/>").find("'$$' is followed by neither '{' nor '('"),
            std::string::npos);
  EXPECT_EQ(expanded_robot("<l v=\"5$ $a $${b}\"/>"), "<l v=\"5$ $a ${b}\"/>\n");
}

TEST(Xacro, LateArgumentDeclarationIsFound) {
  const std::string text =
      expanded_robot("<l x=\"$(arg use_sim)\"/>\n<xacro:arg name=\"use_sim\" default=\"true\"/>");
  EXPECT_NE(text.find("arm.xacro:2:4: error: undefined substitution argument 'use_sim': it is declared at "
                      "arm.xacro:3:1"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace doppel
