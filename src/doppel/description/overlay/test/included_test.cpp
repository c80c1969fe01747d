// The overlays beside included files.
#include <unistd.h>

#include "overlay_fixture.h"

namespace doppel::overlay_test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHead = R"(<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm">)";

std::string joint(const std::string& name, const std::string& parent, const std::string& child) {
  return "<joint name=\"" + name + "\" type=\"revolute\"><parent link=\"" + parent + "\"/><child link=\"" +
         child +
         "\"/><axis xyz=\"0 0 1\"/><limit lower=\"-1\" upper=\"1\" effort=\"5\" velocity=\"2\"/></joint>\n";
}

std::string arm_with_prefix(const std::string& p) {
  return "<link name=\"" + p + "base\"/><link name=\"" + p + "upper\"/><link name=\"" + p + "tip\"/>\n" +
         joint(p + "shoulder", p + "base", p + "upper") + joint(p + "elbow", p + "upper", p + "tip");
}

constexpr const char* kFlips = R"(- flip_axis: shoulder
  was: {axis: 0 0 1}

- set_limit: elbow
  velocity: 3
  was: {velocity: 2}
)";

struct IncludedOverlay : testing::Test {
  IncludedOverlay() : folder(fs::temp_directory_path() / ("doppel_included_" + std::to_string(getpid()))) {
    fs::remove_all(folder);
    fs::create_directories(folder / "arm");
  }
  ~IncludedOverlay() override { fs::remove_all(folder); }
  IncludedOverlay(const IncludedOverlay&) = delete;
  IncludedOverlay& operator=(const IncludedOverlay&) = delete;

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder / name) << text; }
  void write_robot(const std::string& name, const std::string& content) const {
    write(name, kHead + content + "</robot>\n");
  }
  void write_arm_macro() const {
    write_robot("arm/arm.xacro", "<xacro:macro name=\"arm\" params=\"prefix\">" +
                                     arm_with_prefix("${prefix}") + "</xacro:macro>");
    write("arm/arm.overlay.yaml", kFlips);
  }
  ExpandedDescription load(const std::string& name = "cell.xacro") {
    ExpandedDescription expanded = expand_description(folder / name, {}, resolver, diagnostics);
    overlays = apply_overlays(expanded, resolver, diagnostics);
    return expanded;
  }
  static std::string value(const ExpandedDescription& robot, const std::string& joint,
                           const std::string& child, const std::string& attribute) {
    for (const XmlNode& node : robot.root.children) {
      if (node.is("joint") && node.find("name")->value == joint)
        return node.first(child)->find(attribute)->value;
    }
    return "no joint " + joint;
  }
  [[nodiscard]] std::size_t count(const std::string& rule, Severity severity) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        diagnostics.all(), [&](const Diagnostic& d) { return d.rule == rule && d.severity == severity; }));
  }
  [[nodiscard]] std::string message(const std::string& rule) const {
    for (const Diagnostic& d : diagnostics.all())
      if (d.rule == rule) return d.message;
    return "";
  }

  fs::path folder;
  PackageResolver resolver;
  Diagnostics diagnostics;
  std::vector<AppliedOverlay> overlays;
};

TEST_F(IncludedOverlay, DescriptionThatIncludesCorrectedOneIsCorrected) {
  write_robot("arm/arm.xacro", arm_with_prefix(""));
  write("arm/arm.overlay.yaml", kFlips);
  write_robot("cell.xacro", "<xacro:include filename=\"arm/arm.xacro\"/><link name=\"camera\"/>");
  const ExpandedDescription robot = load();
  EXPECT_EQ(value(robot, "shoulder", "axis", "xyz"), "0 0 -1");
  EXPECT_EQ(value(robot, "elbow", "limit", "velocity"), "3");
  EXPECT_EQ(count("overlay.included", Severity::note), 1U);
  EXPECT_EQ(count("overlay.no_target", Severity::warning), 0U);
  EXPECT_THAT(robot.files, testing::Contains(folder / "arm/arm.overlay.yaml"));
}

TEST_F(IncludedOverlay, FileIncludedTwiceIsCorrectedOnce) {
  write_robot("arm/arm.xacro", "<xacro:unless value=\"${done}\">" + arm_with_prefix("") + "</xacro:unless>");
  write("arm/arm.overlay.yaml", kFlips);
  write_robot(
      "cell.xacro",
      "<xacro:property name=\"done\" value=\"false\"/><xacro:include filename=\"arm/arm.xacro\"/>"
      "<xacro:property name=\"done\" value=\"true\"/><xacro:include filename=\"arm/../arm/arm.xacro\"/>");
  EXPECT_EQ(value(load(), "shoulder", "axis", "xyz"), "0 0 -1");
  EXPECT_EQ(overlays.size(), 1U);
}

TEST_F(IncludedOverlay, OverlaySharedByFileAndIncludedFileIsAppliedOnce) {
  write_arm_macro();
  write_robot("arm/arm.urdf.xacro", "<xacro:include filename=\"arm.xacro\"/><xacro:arm prefix=\"\"/>");
  EXPECT_EQ(value(load("arm/arm.urdf.xacro"), "shoulder", "axis", "xyz"), "0 0 -1");
  EXPECT_EQ(overlays.size(), 1U);
  write_robot("cell.xacro", "<xacro:include filename=\"arm/arm.urdf.xacro\"/>");
  EXPECT_EQ(value(load(), "shoulder", "axis", "xyz"), "0 0 -1");
  EXPECT_EQ(overlays.size(), 1U);
}

TEST_F(IncludedOverlay, InnerOverlayPrecedesOuterOnes) {
  write_robot("arm/arm.xacro", arm_with_prefix(""));
  write("arm/arm.overlay.yaml", kFlips);
  write_robot("arm/tool.xacro", "<xacro:include filename=\"arm.xacro\"/><link name=\"tool\"/>");
  write("arm/tool.overlay.yaml", "- set_limit: elbow\n  velocity: 4\n  was: {velocity: 3}\n");
  write_robot("cell.xacro", "<xacro:include filename=\"arm/tool.xacro\"/>");
  write("cell.overlay.yaml", "- set_limit: elbow\n  velocity: 5\n  was: {velocity: 4}\n");
  EXPECT_EQ(value(load(), "elbow", "limit", "velocity"), "5");
  ASSERT_EQ(overlays.size(), 3U);
  EXPECT_EQ(overlays[0].overlay.file, folder / "arm/arm.overlay.yaml");
  EXPECT_EQ(overlays[1].overlay.file, folder / "arm/tool.overlay.yaml");
  EXPECT_FALSE(overlays[2].included);
}

TEST_F(IncludedOverlay, PrefixOfMacroParameterIsFollowedForEveryCall) {
  write_arm_macro();
  write_robot("cell.xacro",
              "<xacro:include filename=\"arm/arm.xacro\"/><xacro:arm prefix=\"left_\"/>"
              "<xacro:property name=\"side\" value=\"right\"/><xacro:arm prefix=\"${side}_\"/>");
  const ExpandedDescription robot = load();
  for (const char* prefix : {"left_", "right_"}) {
    EXPECT_EQ(value(robot, std::string(prefix) + "shoulder", "axis", "xyz"), "0 0 -1");
    EXPECT_EQ(value(robot, std::string(prefix) + "elbow", "limit", "velocity"), "3");
  }
  ASSERT_EQ(overlays.size(), 2U);
  EXPECT_EQ(overlays[0].prefix, "left_");
  EXPECT_EQ(overlays[1].prefix, "right_");
}

TEST_F(IncludedOverlay, PrefixIsFollowedThroughMacrosThatHandItOn) {
  write_robot("arm/arm.xacro",
              "<xacro:macro name=\"part\" params=\"name\"><link name=\"${name}\"/></xacro:macro>"
              "<xacro:macro name=\"arm\" params=\"p\"><xacro:part name=\"${p}base\"/>"
              "<xacro:part name=\"${p}forebase\"/></xacro:macro>");
  write("arm/arm.overlay.yaml",
        "- remove_link: forebase\n  was: {joint: none, parent: none}\n\n"
        "- rename_link: base\n  to: foot\n  was: {joint: none, parent: none}\n");
  write_robot("cell.xacro", "<xacro:include filename=\"arm/arm.xacro\"/><xacro:arm p=\"left_\"/>");
  const ExpandedDescription robot = load();
  ASSERT_EQ(overlays.size(), 1U) << "'left_fore' is a part of a name and no prefix";
  std::vector<std::string> links;
  for (const XmlNode& node : robot.root.children)
    if (node.is("link")) links.push_back(node.find("name")->value);
  EXPECT_THAT(links, testing::ElementsAre("left_foot"));
}

TEST_F(IncludedOverlay, NamesThatDifferAreOneWarningWithReason) {
  write_robot("arm/arm.xacro",
              "<xacro:macro name=\"arm\" params=\"s\">" + arm_with_prefix("arm${s}_") + "</xacro:macro>");
  write("arm/arm.overlay.yaml", kFlips);
  write_robot("cell.xacro", "<xacro:include filename=\"arm/arm.xacro\"/><xacro:arm s=\"7\"/>");
  EXPECT_EQ(value(load(), "arm7_shoulder", "axis", "xyz"), "0 0 1");
  EXPECT_EQ(count("overlay.no_target", Severity::warning), 1U);
  EXPECT_THAT(message("overlay.no_target"), testing::HasSubstr("2 corrections beside the included"));
  EXPECT_THAT(message("overlay.no_target"), testing::HasSubstr("there is no joint 'shoulder'"));
}

TEST_F(IncludedOverlay, MissingTargetsOfIncludedFileAreOneWarning) {
  write_robot("arm/arm.xacro", "<link name=\"base\"/>");
  write("arm/arm.overlay.yaml", std::string(kFlips) +
                                    "\n- rename_link: base\n  to: foot\n"
                                    "  was: {joint: none, parent: none}\n");
  write_robot("cell.xacro", "<xacro:include filename=\"arm/arm.xacro\"/>");
  load();
  EXPECT_EQ(count("overlay.no_target", Severity::warning), 1U);
  EXPECT_THAT(message("overlay.no_target"), testing::HasSubstr("2 of 3 corrections"));
}

TEST_F(IncludedOverlay, MacroThatIsNotCalledIsNote) {
  write_arm_macro();
  write_robot("cell.xacro", "<xacro:include filename=\"arm/arm.xacro\"/><link name=\"base\"/>");
  load();
  EXPECT_EQ(count("overlay.included", Severity::note), 1U);
  EXPECT_EQ(count("overlay.no_target", Severity::warning), 0U);
}

TEST_F(IncludedOverlay, NamesOfOtherFilesAreNotCorrected) {
  write_robot("arm/arm.xacro", "<link name=\"spare\"/>");
  write("arm/arm.overlay.yaml", kFlips);
  write_robot("cell.xacro", "<xacro:include filename=\"arm/arm.xacro\"/>" + arm_with_prefix(""));
  EXPECT_EQ(value(load(), "shoulder", "axis", "xyz"), "0 0 1");
}

TEST_F(IncludedOverlay, IncludingFileDecidesWhereRobotStands) {
  write_robot("arm/arm.xacro", arm_with_prefix(""));
  write("arm/arm.overlay.yaml", std::string(kFlips) +
                                    "\n- attach_to_world: base\n  was: {parent: none}\n\n"
                                    "- rename_robot: arm\n  to: armed\n  was: {name: arm}\n");
  write("cell.xacro",
        "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"cell\">"
        "<xacro:include filename=\"arm/arm.xacro\"/><link name=\"table\"/>" +
            joint("mount", "table", "base") + "</robot>");
  const ExpandedDescription robot = load();
  ASSERT_EQ(overlays.size(), 1U);
  EXPECT_EQ(overlays[0].outcomes[2].state, OperationState::superseded);
  EXPECT_EQ(overlays[0].outcomes[3].state, OperationState::superseded);
  EXPECT_EQ(count("overlay.changed", Severity::warning), 0U);
  EXPECT_EQ(robot.root.find("name")->value, "cell");
}

TEST_F(IncludedOverlay, OverlaysOfAllSourcesAreWatched) {
  EXPECT_THAT(overlay_paths({"a/cell.urdf.xacro", "b/arm.xacro", "b/limits.yaml"}),
              testing::ElementsAre(fs::path("a/cell.overlay.yaml"), fs::path("b/arm.overlay.yaml")));
}

}  // namespace
}  // namespace doppel::overlay_test
