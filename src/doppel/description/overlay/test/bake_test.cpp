#include "doppel/description/overlay/bake.h"

#include <unistd.h>

#include "doppel/description/overlay/test/overlay_fixture.h"

namespace doppel {
namespace {

using namespace overlay_test;
namespace fs = std::filesystem;
using testing::Each;
using testing::HasSubstr;

// A description in two files: a macro that is called twice, with arguments that are passed on, a property,
// comments and a layout that must be preserved.
constexpr const char* kMain = R"(<?xml version="1.0"?>
<!-- my arm -->
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="joints.xacro"/>
  <xacro:property name="strong" value="100"/>
  <link name="base"><inertial><mass   value = '2.0' /><!-- weighed -->
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
  <link name="a"/>	<link name="b"/>
  <link name="c"/>

  <xacro:servo_joint name="J1" parent="base" child="a" upper="3.14" axis="1 0 0"/>  <!-- the shoulder -->
  <xacro:servo_joint name="J2" parent="a" child="b" upper="${2*1.57}" axis="0 1 0"/>
  <joint name="J3" type="revolute"><parent link="b"/><child link="c"/>
    <axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="${strong}" velocity="100"/></joint>
</robot>
)";
constexpr const char* kJoints = R"(<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="limited" params="upper">
    <limit lower="0" upper="${upper}" effort="100" velocity="60"/>
  </xacro:macro>
  <xacro:macro name="servo_joint" params="name parent child upper axis">
    <joint name="${name}" type="revolute">
      <parent link="${parent}"/><child link="${child}"/>
      <origin xyz="0 0 0.1" rpy="0 0 0"/>
      <axis xyz="${axis}"/>
      <xacro:limited upper="${upper}"/>
    </joint>
  </xacro:macro>
</robot>
)";

class BakeTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("doppel_bake_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    main_ = folder_ / "arm.xacro";
    write(main_, kMain);
    write(folder_ / "joints.xacro", kJoints);
  }
  void TearDown() override { fs::remove_all(folder_); }
  static void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }
  static std::string read(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  ExpandedDescription expand() { return expand_description(main_, {}, resolver_, diagnostics_); }

  // Bakes and returns the diagnostics; on success the sources expand to the corrected tree and every
  // operation is in them.
  std::string bake(const std::string& yaml) {
    Bench bench;
    bench.description = expand();
    const ExpandedDescription plain = bench.description;
    const Overlay overlay = bench.stamped(yaml);
    EXPECT_THAT(bench.apply(overlay), Each(OperationState::applied));
    try {
      write_baked(bake_in_place(plain, bench.description),
                  [&] { return same_expansion(expand().root, bench.description.root); });
    } catch (const InputError& error) {
      return error.what();
    }
    EXPECT_TRUE(same_expansion(expand().root, bench.description.root));
    bench.description = expand();
    EXPECT_THAT(bench.apply(overlay), Each(OperationState::already_there))
        << testing::PrintToString(bench.messages);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2)
        << "expected no other file to be left behind";
    return "";
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  }
  fs::path folder_, main_;
  PackageResolver resolver_;
  Diagnostics diagnostics_;
};

TEST_F(BakeTest, OnlyValueIsChanged) {
  EXPECT_EQ(bake("- set_inertia: base\n  mass: 2.5"), "");
  EXPECT_EQ(read(main_), replaced(kMain, "value = '2.0'", "value = '2.5'"));
  EXPECT_EQ(read(folder_ / "joints.xacro"), kJoints);
}

TEST_F(BakeTest, ArgumentIsWrittenThroughTwoMacros) {
  EXPECT_EQ(bake("- set_limit: J1\n  upper: 3\n- flip_axis: J1"), "");
  EXPECT_EQ(read(main_),
            replaced(replaced(kMain, "upper=\"3.14\"", "upper=\"3\""), "\"1 0 0\"", "\"-1 0 0\""));
  EXPECT_EQ(read(folder_ / "joints.xacro"), kJoints);
}

TEST_F(BakeTest, RenameWritesCallArgument) {
  EXPECT_EQ(bake("- rename_joint: J1\n  to: shoulder"), "");
  EXPECT_EQ(read(main_), replaced(kMain, "name=\"J1\"", "name=\"shoulder\""));
}

TEST_F(BakeTest, MacroIsWrittenOnceWhenAllCallsAgree) {
  EXPECT_EQ(bake("- set_limit: J1\n  effort: 3.5\n- set_limit: J2\n  effort: 3.5"), "");
  EXPECT_EQ(read(folder_ / "joints.xacro"), replaced(kJoints, "effort=\"100\"", "effort=\"3.5\""));
  EXPECT_EQ(read(main_), kMain);
}

TEST_F(BakeTest, MacroChangedByOneCallIsRefused) {
  const std::string said = bake("- set_limit: J1\n  effort: 3.5\n- set_inertia: base\n  mass: 2.5");
  EXPECT_THAT(said, HasSubstr("joints.xacro:3:39"));
  EXPECT_THAT(said, HasSubstr("effort of <limit> cannot be written here: 2 elements come from this place"));
  EXPECT_EQ(read(main_), kMain);
  EXPECT_EQ(read(folder_ / "joints.xacro"), kJoints);
}

TEST_F(BakeTest, ExpressionInCallIsRefused) {
  EXPECT_THAT(bake("- set_limit: J2\n  upper: 3"), HasSubstr("upper of <limit>"));
  EXPECT_EQ(read(main_), kMain);
}

TEST_F(BakeTest, PropertyIsReplacedAtUse) {
  EXPECT_EQ(bake("- set_limit: J3\n  effort: 3.5"), "");
  EXPECT_EQ(read(main_), replaced(kMain, "${strong}", "3.5"));
}

TEST_F(BakeTest, AttributesElementsAndBlocksAreAdded) {
  EXPECT_EQ(bake("- set_dynamics: J3\n  damping: 0.5\n- add_mimic: J3\n  leader: J2\n- attach_to_world:\n"
                 "- add_ros2_control: Hw\n  plugin: a/B\n  joints: [J3]\n  params: {path: \"${x}\"}"),
            "");
  EXPECT_THAT(read(main_),
              HasSubstr("velocity=\"100\"/>\n    <dynamics damping=\"0.5\"/>\n    <mimic joint=\"J2\""));
  EXPECT_THAT(read(main_), HasSubstr("<param name=\"path\">$${x}</param>"));
  EXPECT_THAT(read(main_), HasSubstr("  <!-- the shoulder -->\n"));
}

TEST_F(BakeTest, ServoBecomesGazeboElement) {
  EXPECT_EQ(bake("- set_servo: J3\n  stiffness: 35\n  viscous: 0.5"), "");
  EXPECT_THAT(read(main_), HasSubstr("<dynamics damping=\"0.5\"/>"));
  EXPECT_THAT(read(main_), HasSubstr("<gazebo reference=\"J3\">\n    <doppel:servo stiffness=\"35\"/>"));
}

TEST_F(BakeTest, RemovalRemovesLine) {
  EXPECT_EQ(bake("- remove_link: c"), "");
  std::string expected = replaced(kMain, "  <link name=\"c\"/>\n", "");
  const std::size_t begin = expected.find("  <joint name=\"J3\""), end = expected.find("</joint>") + 9;
  expected.erase(begin, end - begin);
  EXPECT_EQ(read(main_), expected);
}

TEST_F(BakeTest, DifferingResultIsRolledBack) {
  Bench bench;
  bench.description = expand();
  const ExpandedDescription plain = bench.description;
  bench.apply(bench.stamped("- set_inertia: base\n  mass: 2.5"));
  const auto files = bake_in_place(plain, bench.description);
  EXPECT_THROW(write_baked(files, [] { return false; }), InputError);
  EXPECT_EQ(read(main_), kMain);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2);
}

TEST_F(BakeTest, WindowsLineEndsAreKept) {
  std::string windows;
  for (const char c : std::string(kMain)) windows += c == '\n' ? "\r\n" : std::string(1, c);
  write(main_, windows);
  EXPECT_EQ(bake("- set_inertia: base\n  mass: 2.5"), "");
  EXPECT_EQ(read(main_), replaced(windows, "'2.0'", "'2.5'"));
}

TEST(SettleMeshes, HullPathsPointIntoPackage) {
  Bench bench;
  bench.apply(bench.stamped("- replace_collision: base\n  by: hull"));
  const auto copies = settle_meshes(bench.description.root, "/pkg", "package://arm/");
  ASSERT_EQ(copies.size(), 1U);
  EXPECT_TRUE(fs::is_regular_file(copies[0].first));
  EXPECT_EQ(copies[0].second, "/pkg/meshes/base_hull.stl");
  EXPECT_THAT(bench.text(), HasSubstr("filename=\"package://arm/meshes/base_hull.stl\""));
}

}  // namespace
}  // namespace doppel
