// Files as found in practice: text before <?xml, left-over xacro, undeclared prefixes.
#include "doppel/description/urdf/load.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std::string_literals::operator""s;

struct Reading {
  std::string xml;               // of what was read
  std::string diagnostics_text;  // warnings, or the error
  bool refused = false;
};

Reading read(const std::string& name, const std::string& text) {
  const fs::path folder = fs::path(testing::TempDir()) / ("load_test." + std::to_string(getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / name, std::ios::binary) << text;
  PackageResolver resolver;
  Diagnostics diagnostics;
  Reading out;
  try {
    out.xml = to_xml(expand_description(folder / name, {}, resolver, diagnostics).root);
  } catch (const InputError& error) {
    out.diagnostics_text = error.what();
    out.refused = true;
  }
  for (const Diagnostic& d : diagnostics.all()) out.diagnostics_text += d.str() + "\n";
  fs::remove_all(folder);
  return out;
}

const std::string kRobot = "<robot name=\"a\"><link name=\"l\"/></robot>";
std::string robot(const std::string& more) {
  return "<robot name=\"a\"><link name=\"l\"/>" + more + "</robot>";
}

// check_urdf accepts each of these as a robot.
TEST(LoadDescription, UrdfdomToleratedFaultIsWarningWithPlace) {
  const std::pair<std::string, std::string> cases[] = {
      {"\n\n  <?xml version=\"1.0\"?>\n" + kRobot,
       ":3:3: warning: the XML is not well-formed: <?xml ...?> is not"},
      {"<!-- hi -->\n<?xml version=\"1.0\"?>\n" + kRobot, ":2:1: warning"},
      {"\xEF\xBB\xBF\n<?xml version=\"1.0\"?>\n" + kRobot, ":2:1: warning"},
      {"<?xml version=\"1.0\"?><?xml version=\"1.0\"?>\n" + kRobot, ":1:22: warning"},
      {robot("<?xml version=\"1.0\"?>"), ":1:33: warning"},
      {kRobot + "\nrest", ":2:1: warning: the XML is not well-formed: there is text after the root element"},
      {kRobot + "\n" + kRobot, ":2:1: warning: the XML is not well-formed: there are two root elements"},
      {"<x/>" + kRobot, ":1:5: warning"},
      {robot("<!-- a -- b -->"),
       ":1:40: warning: the XML is not well-formed: '--' is not allowed in a comment"},
      {robot("<!-- a <!-- b -->"), ":1:42: warning"},
      {robot("<gazebo><x>a & b</x></gazebo>"),
       ":1:46: warning: the XML is not well-formed: '&' does not start"},
      {robot("<gazebo x=\"a&foo;\"/>"), "the entity &foo; is not defined"},
      {robot("<gazebo x=\"a<b\"/>"), "'<' is not allowed in the value of x"},
      {robot("<gazebo x=l/>"), "the value of x needs quotes"},
      {robot("<gazebo x=l ></gazebo>"), "the value of x needs quotes"},
      {robot("<gazebo x=\"l\"y=\"m\"/>"), "unexpected 'y' in <gazebo>"},
      {robot("<gazebo>]]></gazebo>"), "']]>' is not allowed in text"},
      {robot("<gazebo>\x01</gazebo>"), "bytes that are not UTF-8"},
      {kRobot + "\n\0\0\0"s, "bytes that are not UTF-8"},
      {robot("<!-- \xE9 -->"),
       ":1:38: warning: the XML is not well-formed: the file contains bytes that are not UTF-8"},
      {"<?xml version=\"1.0\" encoding=\"gb2312\"?>" + robot("<!-- \xD6\xD0 -->"),
       "bytes that are not UTF-8"}};
  for (const auto& [text, wanted] : cases) {
    const Reading got = read("a.urdf", text);
    EXPECT_FALSE(got.refused) << text << "\n" << got.diagnostics_text;
    EXPECT_NE(got.xml.find("<link name=\"l\"/>"), std::string::npos) << text << "\n" << got.xml;
    EXPECT_NE(got.diagnostics_text.find(wanted), std::string::npos) << text << "\n" << got.diagnostics_text;
    EXPECT_NE(got.diagnostics_text.find("[xml.tolerated]"), std::string::npos) << text << "\n"
                                                                               << got.diagnostics_text;
  }
}

TEST(LoadDescription, UnreadableFileIsRefused) {
  for (const std::string& text :
       {"hello\n" + kRobot, "\n\xEF\xBB\xBF" + kRobot, robot("<!-- a"),
        robot("<link name=\"l\" name=\"m\"/>"), "<robot name=\"a\"><link name=\"l\"/>"s,
        "<robot name=\"a\"><link name=\"l\"></lin></robot>"s, robot("<link fixed/>"), ""s}) {
    const Reading got = read("a.urdf", text);
    EXPECT_TRUE(got.refused) << text;
    EXPECT_NE(got.diagnostics_text.find("[xml.not_well_formed]"), std::string::npos) << got.diagnostics_text;
  }
}

TEST(LoadDescription, XacroFaultIsRefusedAsByReference) {
  for (const std::string& text : {kRobot + "rest", robot("<!-- a -- b -->"), robot("<gazebo x=l/>")}) {
    EXPECT_TRUE(read("a.xacro", text).refused) << text;
    const std::string property = "<xacro:property name=\"p\" value=\"1\"/>";
    EXPECT_TRUE(read("a.urdf", text.substr(0, 16) + property + text.substr(16)).refused) << text;
  }
}

TEST(LoadDescription, TextBeforeDeclarationIsWarning) {
  const Reading got =
      read("a.xacro", "<!-- hi -->\n\n<?xml version=\"1.0\"?>\n" + robot("<link name=\"${1 + 1}\"/>"));
  EXPECT_NE(got.xml.find("<link name=\"2\"/>"), std::string::npos) << got.diagnostics_text;
  EXPECT_NE(got.diagnostics_text.find(":3:1: warning"), std::string::npos) << got.diagnostics_text;
  EXPECT_NE(got.diagnostics_text.find("ros/xacro rejects the file"), std::string::npos)
      << got.diagnostics_text;
}

// As ros/xacro reads them: a declared encoding that is not that of the file has no effect.
TEST(LoadDescription, Utf8IsReadDespiteDeclaredEncoding) {
  for (const char* encoding : {"gb2312", "utf-16", "ISO-8859-1", "foo"}) {
    const Reading got = read("a.xacro", "<?xml version=\"1.0\" encoding=\""s + encoding + "\"?>" +
                                            robot("<link name=\"\xC3\xA4${1 + 1}\"/>"));
    EXPECT_NE(got.xml.find("<link name=\"\xC3\xA4"
                           "2\"/>"),
              std::string::npos)
        << encoding << got.xml << got.diagnostics_text;
    EXPECT_EQ(got.diagnostics_text, "") << encoding;
  }
}

TEST(LoadDescription, FileWithoutXacroNamespaceIsExpanded) {
  const std::string text = robot("<link name=\"${1 + 1}\"/>");
  for (const char* name : {"plain.urdf.xacro", "plain.urdf"}) {
    const Reading got = read(name, text);
    EXPECT_NE(got.xml.find("<link name=\"2\"/>"), std::string::npos)
        << name << got.xml << got.diagnostics_text;
    EXPECT_EQ(got.diagnostics_text, "") << name;
  }
  EXPECT_NE(read("price.urdf", robot("<gazebo>5$ ${</gazebo>")).diagnostics_text.find("is not closed"),
            std::string::npos);
  EXPECT_EQ(read("price.urdf", robot("<gazebo>5$ a</gazebo>")).diagnostics_text, "");
}

TEST(LoadDescription, UndeclaredPrefixIsRefusedInXacroOnly) {
  const std::string sensor = "<gazebo><sensor:camera name=\"c\"/></gazebo>";
  const Reading refused = read("ns.xacro", robot(sensor));
  EXPECT_TRUE(refused.refused);
  EXPECT_NE(refused.diagnostics_text.find("ns.xacro:1:41: error: the prefix 'sensor' is not declared"),
            std::string::npos)
      << refused.diagnostics_text;
  EXPECT_EQ(read("ns.urdf", robot(sensor)).diagnostics_text, "");
  EXPECT_EQ(read("ns.xacro",
                 robot("<gazebo xmlns:sensor=\"x\"><sensor:camera sensor:y=\"1\" xml:lang=\"e\"/></gazebo>"))
                .diagnostics_text,
            "");
  EXPECT_TRUE(read("ns.xacro", robot("<gazebo xmlns:sensor=\"x\"/><sensor:camera/>")).refused);
  EXPECT_TRUE(read("ns.xacro", robot("<gazebo sensor:x=\"1\"/>")).refused);
  const Reading own =
      read("own.xacro", robot("<xacro:property name=\"p\" value=\"7\"/><link name=\"${p}\"/>"));
  EXPECT_NE(own.xml.find("<link name=\"7\"/>"), std::string::npos) << own.diagnostics_text;
  EXPECT_NE(own.diagnostics_text.find("own.xacro:1:33: warning: the prefix 'xacro' is not declared"),
            std::string::npos)
      << own.diagnostics_text;
}

TEST(LoadDescription, LeftOverXacroIsWarningInUrdfAndErrorInXacro) {
  const std::string space = "<robot name=\"a\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">";
  const std::string text = space + "<link name=\"l\"/><xacro:x/></robot>";
  const Reading got = read("a.urdf", text);
  EXPECT_NE(got.xml.find("<link name=\"l\"/>"), std::string::npos) << got.diagnostics_text;
  EXPECT_EQ(got.xml.find("xacro:x"), std::string::npos);
  EXPECT_NE(got.diagnostics_text.find("a.urdf:1:77: warning: unknown macro 'x'"), std::string::npos)
      << got.diagnostics_text;
  EXPECT_NE(got.diagnostics_text.find("[xacro.left_over]"), std::string::npos) << got.diagnostics_text;
  EXPECT_TRUE(read("a.xacro", text).refused);

  const Reading undeclared = read("a.urdf", robot("<xacro:x/>"));
  EXPECT_FALSE(undeclared.refused) << undeclared.diagnostics_text;
  EXPECT_NE(undeclared.diagnostics_text.find("[xacro.left_over]"), std::string::npos)
      << undeclared.diagnostics_text;
}

TEST(LoadDescription, MissingPackageNamesNearest) {
  const fs::path folder = fs::path(testing::TempDir()) / ("near_name." + std::to_string(getpid()));
  fs::create_directories(folder / "src/arm_description");
  std::ofstream(folder / "src/arm_description/package.xml")
      << "<package><name>arm_description</name></package>";
  std::ofstream(folder / "a.xacro") << robot("<xacro:include filename=\"$(find arm_descripton)/x.xacro\"/>");
  PackageResolver resolver;
  Diagnostics diagnostics;
  std::string diagnostics_text;
  try {
    expand_description(folder / "a.xacro", {}, resolver, diagnostics);
  } catch (const InputError& error) {
    diagnostics_text = error.what();
  }
  fs::remove_all(folder);
  EXPECT_NE(diagnostics_text.find("; did you mean 'arm_description'? Looked in:\n"), std::string::npos)
      << diagnostics_text;
}

TEST(LoadDescription, XacroFaultInUrdfIsRefused) {
  const std::string begin =
      "<robot name=\"a\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><link name=\"l\"/><link "
      "name=\"m\"/>";
  const std::string macro = "<xacro:macro name=\"arm\" params=\"n\"><link name=\"x${n}\"/></xacro:macro>";
  const std::pair<std::string, std::string> cases[] = {
      {"<xacro:include filename=\"$(find nowhere_at_all)/x.xacro\"/><xacro:arm/>", "xacro.package_not_found"},
      {"<xacro:include filename=\"nowhere.xacro\"/>", "xacro.file_not_found"},
      {macro + "<xacro:arm n=\"${1/0}\"/>", "xacro.division_by_zero"},
      {macro + "<xacro:arm nn=\"1\"/>", "xacro.unknown_parameter"},
      {macro + "<xacro:arn n=\"1\"/>", "xacro.unknown_macro"},
      {"<xacro:property name=\"p\" value=\"1\"/><xacro:x/>", "xacro.unknown_macro"},
      {"<xacro:arg name=\"p\" default=\"1\"/><xacro:x/>", "xacro.unknown_macro"},
      {"<xacro:if value=\"1\"><link name=\"n\"/></xacro:if><xacro:x/>", "xacro.unknown_macro"},
      {"<xacro:x><link name=\"n\"/></xacro:x>", "xacro.unknown_macro"},
      {"<xacro:x n=\"${1}\"/>", "xacro.unknown_macro"},
      {"<link name=\"${nothing}\"/>", "xacro.undefined_name"}};
  for (const auto& [more, rule] : cases) {
    for (const char* name : {"a.urdf", "a.xacro"}) {
      const Reading got = read(name, begin + more + "</robot>");
      EXPECT_TRUE(got.refused) << name << more << got.diagnostics_text;
      EXPECT_NE(got.diagnostics_text.find("[" + rule + "]"), std::string::npos)
          << name << more << got.diagnostics_text;
    }
  }
}

}  // namespace
}  // namespace doppel
