// Whatever files are next to a description, the audit terminates and reports what it did not read.
#include "doppel/scenario/resolve/side_files.h"

#include <sys/stat.h>

#include <random>

#include "doppel/review/audit/detail/package_files.h"
#include "doppel/review/audit/test/audit_rig.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class SideFilesTest : public AuditRig {
 protected:
  SideFilesTest() {
    write(
        "package.xml",
        "<package format=\"3\"><name>p</name><version>1.0.0</version><description>d</description><maintainer "
        "email=\"a@b.c\">m</maintainer><license>MIT</license></package>");
    write("urdf/r.urdf", robot(good_hardware()));
  }
  void pipe(const std::string& name) {
    fs::create_directories((folder_ / name).parent_path());
    ASSERT_EQ(mkfifo((folder_ / name).c_str(), 0600), 0);
  }
  void link(const std::string& target, const std::string& name) {
    fs::create_directories((folder_ / name).parent_path());
    fs::create_symlink(target, folder_ / name);
  }
  void endless(const std::string& name) {
    write(name, "");
    fs::resize_file(folder_ / name, std::uintmax_t{4} << 30);  // sparse: takes no space on the disk
  }
  // Notes of what was not read, by file name; no other finding may result.
  std::vector<std::string> skipped() {
    std::vector<std::string> out;
    for (const Finding& f : of("audit.skipped")) {
      EXPECT_EQ(f.severity, Severity::note);
      EXPECT_FALSE(f.message.empty());
      out.push_back(f.subject);
    }
    return out;
  }
  std::string cmake(const std::string& text) {
    write("CMakeLists.txt", "project(p)\n" + text);
    const InstallRules rules = read_cmake(folder_ / "CMakeLists.txt");
    return rules.understood ? "understood" : rules.given_up.empty() ? "unknown" : rules.given_up;
  }
};

using testing::ElementsAre;
using testing::IsEmpty;

TEST_F(SideFilesTest, SelfReferencingCMakeVariableIsUnknown) {
  EXPECT_EQ(cmake("set(D ${D})\ninstall(DIRECTORY ${D} DESTINATION share/${PROJECT_NAME})\n"), "unknown");
  EXPECT_EQ(cmake("set(A ${B})\nset(B ${A})\ninstall(DIRECTORY ${A} ${B} DESTINATION share/p)\n"), "unknown");
  EXPECT_EQ(cmake("set(D urdf)\nset(D ${D}/more)\ninstall(DIRECTORY ${D} DESTINATION share/p)\n"),
            "understood");
  EXPECT_EQ(read_cmake(folder_ / "CMakeLists.txt").paths.front().from, "urdf/more");
  EXPECT_THAT(skipped(), IsEmpty());
}

TEST_F(SideFilesTest, DoublingCMakeVariableIsUnknown) {
  std::string text = "set(A urdf)\n";
  for (int i = 0; i < 200; ++i) text += "set(A ${A}${A})\n";
  EXPECT_EQ(cmake(text + "install(DIRECTORY ${A} DESTINATION share/p)\n"), "unknown");
}

TEST_F(SideFilesTest, NestedCMakeLoopsEndWithNote) {
  std::string many, deep;
  for (int i = 0; i < 12; ++i) many += "foreach(v 0 1 2 3 4 5 6 7 8 9)\n";
  for (int i = 0; i < 5000; ++i) deep += "foreach(v 0)\n";
  EXPECT_NE(cmake(many).find("more commands than the audit evaluates"), std::string::npos);
  EXPECT_THAT(skipped(), ElementsAre("CMakeLists.txt"));
  EXPECT_NE(cmake(deep).find("deeper than the audit evaluates"), std::string::npos);
  EXPECT_THAT(skipped(), ElementsAre("CMakeLists.txt"));
}

TEST_F(SideFilesTest, PipesAndDevicesAreSkipped) {
  pipe("CMakeLists.txt");
  pipe("launch/a.launch.py");
  pipe("config/b.yaml");
  link("/dev/zero", "launch/c.launch.py");
  link("/dev/zero", "config/d.yaml");
  EXPECT_THAT(skipped(), testing::UnorderedElementsAre("CMakeLists.txt", "a.launch.py", "b.yaml",
                                                       "c.launch.py", "d.yaml"));
}

TEST_F(SideFilesTest, HugeFilesAreSkipped) {
  endless("CMakeLists.txt");
  endless("launch/a.launch.py");
  endless("config/b.yaml");
  EXPECT_THAT(skipped(), testing::UnorderedElementsAre("CMakeLists.txt", "a.launch.py", "b.yaml"));
  endless("package.xml");
  EXPECT_THAT(skipped(), testing::UnorderedElementsAre("package.xml", "b.yaml"));
}

TEST_F(SideFilesTest, HugeMeshIsNotMeasured) {
  endless("urdf/huge.stl");
  const std::string link =
      "<link name=\"huge\"><collision><geometry><mesh filename=\"huge.stl\"/></geometry></collision></link>"
      "<joint name=\"h\" type=\"fixed\"><parent link=\"base\"/><child link=\"huge\"/></joint>";
  const auto found = of("audit.skipped", link);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().subject, "link 'huge'");
  EXPECT_THAT(of("mesh.unreadable", link), IsEmpty());
}

TEST_F(SideFilesTest, CyclicSymlinksAreSkipped) {
  link("a.launch.py", "launch/a.launch.py");
  link("b.yaml", "config/b.yaml");
  EXPECT_THAT(skipped(), testing::UnorderedElementsAre("a.launch.py", "b.yaml"));
}

TEST_F(SideFilesTest, FullFolderIsReadInPart) {
  for (int i = 0; i < 70; ++i) write("launch/" + std::to_string(100 + i) + ".launch.py", "pass\n");
  EXPECT_THAT(skipped(), ElementsAre("launch"));
  for (std::size_t i = 0; i < kMaxSideEntries; ++i) write("config/" + std::to_string(i) + ".txt", "");
  EXPECT_THAT(skipped(), testing::UnorderedElementsAre("launch"));
  write("config/one_more.yaml", "");
  EXPECT_THAT(skipped(), testing::UnorderedElementsAre("launch", "config"));
}

TEST_F(SideFilesTest, YamlAliasBombEnds) {
  std::string bomb = "controller_manager:\n  ros__parameters:\n    a0: &a0 {x: 1}\n";
  for (int i = 1; i < 40; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "    a" + std::to_string(i) + ": &a" + std::to_string(i) + " {l: " + before + ", r: " + before +
            "}\n";
  }
  write("config/c.yaml", bomb);
  EXPECT_THAT(of("controllers.unknown_type"), IsEmpty());
  write("config/c.yaml", "controller_manager: &m\n  ros__parameters: *m\n");
  EXPECT_THAT(of("controllers.unknown_type"), IsEmpty());
  write("config/c.yaml", std::string(100000, '['));
  EXPECT_THAT(of("controllers.unknown_type"), IsEmpty());
  write("config/actuators.yaml", std::string(100000, '{'));
  EXPECT_EQ(of("datasheet.invalid").size(), 1U);
}

TEST_F(SideFilesTest, DeeplyNestedManifestIsInvalid) {
  std::string deep = "<package>";
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  write("package.xml", deep);
  EXPECT_EQ(of("package.invalid").size(), 1U);
}

TEST_F(SideFilesTest, CyclicDatasheetsAreRefused) {
  write("config/actuators.yaml", "joints: {shoulder: other.yaml}\n");
  write("config/other.yaml", "joints: {shoulder: actuators.yaml}\n");
  const auto found = of("datasheet.invalid");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found.front().message.find("not an actuator datasheet"), std::string::npos);
}

TEST_F(SideFilesTest, SetupPyEndingInCommentIsRead) {
  write("setup.py", "package_name = 'p'\nsetup(data_files=['#', ('share/p', ['package.xml'])] # no more");
  EXPECT_EQ(read_setup_py(folder_ / "setup.py").project, "p");
  write("setup.py", "data_files=[\n '#',\n ]#");
  EXPECT_TRUE(read_setup_py(folder_ / "setup.py").paths.empty());
}

TEST_F(SideFilesTest, PatternWithManyStarsMatchesInLinearTime) {
  InstallRules rules;
  std::string stars;
  for (int i = 0; i < 60; ++i) stars += "a*";
  rules.paths.push_back({"meshes/" + stars + "b", true, "meshes", {}});
  EXPECT_FALSE(rules.installed("meshes/" + std::string(4000, 'a')));
  EXPECT_TRUE(rules.installed("meshes/" + std::string(4000, 'a') + "b"));
  rules.paths = {{"meshes/*.stl", true, "meshes", {}}};
  EXPECT_TRUE(rules.installed("meshes/a.b.stl"));
  EXPECT_FALSE(rules.installed("meshes/visual/a.stl"));
}

// However the tokens of these files are ordered, the readers return.
TEST_F(SideFilesTest, RandomBuildFilesAreReadToEnd) {
  const std::vector<std::string> words{"set(",
                                       "foreach(",
                                       "endforeach(",
                                       "install(",
                                       "project(",
                                       "DIRECTORY",
                                       "DESTINATION",
                                       "${A}",
                                       "${",
                                       "}",
                                       "A",
                                       "share/p",
                                       "\"",
                                       ")",
                                       "(",
                                       "[",
                                       "]",
                                       "#",
                                       "\n",
                                       " ",
                                       ";",
                                       "'",
                                       ",",
                                       "data_files=[",
                                       "package_name",
                                       "*",
                                       "glob",
                                       "join",
                                       "IN",
                                       "os.walk",
                                       "${PROJECT_NAME}",
                                       "=",
                                       "+"};
  std::mt19937 random{20241122};
  for (int round = 0; round < 1000; ++round) {
    std::string text;
    const auto count = 1 + random() % 60;
    for (std::size_t i = 0; i < count; ++i)
      text += words[random() % words.size()] + (random() % 3 == 0 ? " " : "");
    write("CMakeLists.txt", text);
    SCOPED_TRACE(text);
    EXPECT_LE(read_cmake(folder_ / "CMakeLists.txt").paths.size(), text.size());
    EXPECT_LE(read_setup_py(folder_ / "CMakeLists.txt").paths.size(), text.size());
  }
}

// Each includes all the others, by a name that they share: following every path would not terminate.
TEST_F(SideFilesTest, XacroFilesOfSameNameAreReadOnce) {
  std::string all;
  for (int i = 0; i < 12; ++i) all += "<xacro:include filename=\"f" + std::to_string(i) + "/part.xacro\"/>\n";
  const std::string head = "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n";
  for (int i = 0; i < 12; ++i) {
    write("urdf/f" + std::to_string(i) + "/part.xacro",
          head + "<xacro:if value=\"0\">\n<xacro:include filename=\"part.xacro\"/>\n" + all +
              "</xacro:if></robot>\n");
  }
  write("urdf/r.xacro", head + all + tree() + "</robot>\n");
  name_ = "urdf/r.xacro";
  EXPECT_THAT(of("xacro.argument_unused"), IsEmpty());
}

}  // namespace
}  // namespace doppel
