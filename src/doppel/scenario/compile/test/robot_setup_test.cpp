#include "doppel/scenario/compile/robot_setup.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManager = "controller_manager:\n  ros__parameters:\n    update_rate: 50\n";

class RobotSetupTest : public ::testing::Test {
 protected:
  // In a separate folder, because the package's neighbours are searched, too.
  RobotSetupTest()
      : folder_(fs::temp_directory_path() / ("doppel_setup_" + std::to_string(::getpid())) / "my_arm") {
    fs::create_directories(folder_ / "urdf");
    fs::create_directories(folder_ / "config");
    write("package.xml", "<package format=\"3\"><name>my_arm</name></package>");
  }
  ~RobotSetupTest() override { fs::remove_all(folder_.parent_path()); }

  void write(const std::string& file, const std::string& text) { std::ofstream(folder_ / file) << text; }
  void write_robot(const std::string& extra) {
    write("urdf/my_arm.urdf.xacro",
          "<robot name=\"my_arm\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">"
          "<xacro:arg name=\"use_sim\" default=\"false\"/>"
          "<link name=\"base\"/><link name=\"arm $(arg use_sim)\"/>"
          "<joint name=\"the joint\" type=\"revolute\"><parent link=\"base\"/><child link=\"arm $(arg "
          "use_sim)\"/>"
          "<axis xyz=\"0 0 1\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>" +
              extra + "</robot>");
  }
  RobotSetup set_up(XacroArguments arguments = {}) {
    Scenario scenario;
    scenario.robots = {{.target = folder_.string()}};
    scenario.robots.front().arguments = std::move(arguments);
    PackageResolver resolver;
    RobotSetup setup = set_up_robot(scenario, scenario.robots.front(), resolver, diagnostics_);
    if (setup.controllers_files.empty()) generate(scenario, setup);
    return setup;
  }
  void generate(const Scenario& scenario, RobotSetup& setup) {
    const auto description = std::make_shared<const RobotDescription>(setup.description.robot);
    const auto model =
        std::make_shared<const Model>(compile_model(*description, BaseKind::fixed, diagnostics_));
    CollisionMeshes meshes;
    const ModelInstance made = make_instance(description, model, {}, meshes, diagnostics_);
    generate_controllers(scenario, scenario.robots.front(), made, setup, diagnostics_);
  }
  [[nodiscard]] bool has(const std::string& rule) const {
    for (const Diagnostic& d : diagnostics_.all()) {
      if (d.rule == rule) return true;
    }
    return false;
  }

  fs::path folder_;
  Diagnostics diagnostics_;
};

TEST_F(RobotSetupTest, ControllersInPackageConfigAreFound) {
  write_robot("");
  write("config/controllers.yaml", kManager);
  write("config/display.yaml", "rviz:\n  colour: red\n");
  EXPECT_EQ(set_up().controllers_origin, (folder_ / "config/controllers.yaml").string());
}

TEST_F(RobotSetupTest, ChoiceBetweenFilesIsReported) {
  write_robot("");
  write("config/a.yaml", kManager);
  write("config/b.yaml", kManager);
  EXPECT_EQ(set_up().controllers_origin, (folder_ / "config/a.yaml").string());
  EXPECT_TRUE(has("up.controllers_chosen"));
}

TEST_F(RobotSetupTest, FileWhoseControllersFindInterfacesIsChosen) {
  const auto controllers = [](const std::string& interface) {
    return std::string(kManager) +
           "    arm: {type: joint_trajectory_controller/JointTrajectoryController}\n"
           "arm:\n  ros__parameters:\n    joints: [the joint]\n    command_interfaces: [" +
           interface + "]\n    state_interfaces: [position]\n";
  };
  write_robot(
      "<ros2_control name=\"s\" type=\"system\"><hardware><plugin>a/B</plugin></hardware><joint name=\"the "
      "joint\">"
      "<command_interface name=\"position\"/><state_interface name=\"position\"/></joint></ros2_control>");
  write("config/a.yaml", controllers("effort"));
  write("config/b.yaml", controllers("position"));
  EXPECT_EQ(set_up().controllers_origin, (folder_ / "config/b.yaml").string());
  write("config/b.yaml", controllers("velocity"));
  EXPECT_EQ(set_up().controllers_origin, "generated");
}

TEST_F(RobotSetupTest, AllFilesOfPluginAreRead) {
  write("config/a.yaml", kManager);
  write("config/b.yaml", "arm:\n  ros__parameters:\n    joints: [j]\n");
  const auto parameters = [&](const char* file) {
    return "<parameters>" + (folder_ / "config" / file).string() + "</parameters>";
  };
  write_robot("<gazebo><plugin filename=\"gz_ros2_control-system\" name=\"p\">" + parameters("a.yaml") +
              parameters("b.yaml") + "</plugin></gazebo>");
  const RobotSetup setup = set_up();
  EXPECT_EQ(setup.controllers_files.size(), 2U);
  EXPECT_NE(setup.controllers.overrides_for("/arm").find("joints"), nullptr);
  EXPECT_FALSE(setup.controllers_named);
}

TEST_F(RobotSetupTest, MissingControllersAreGenerated) {
  write_robot("");
  const RobotSetup setup = set_up();
  EXPECT_EQ(setup.controllers_origin, "generated");
  EXPECT_TRUE(has("up.controllers_generated"));
  ParameterOverrides overrides = setup.controllers.overrides_for("joint_trajectory_controller");
  ASSERT_NE(overrides.find("joints"), nullptr);
  EXPECT_EQ(std::get<std::vector<std::string>>(overrides.find("joints")->value),
            std::vector<std::string>{"the joint"});
}

TEST_F(RobotSetupTest, GeneratedControllersNoteNamesOtherFiles) {
  write_robot("");
  write("config/rover.yaml",
        std::string(kManager) + "    c: {type: a/B}\nc:\n  ros__parameters:\n    joints: [wheel]\n");
  EXPECT_EQ(set_up().controllers_origin, "generated");
  EXPECT_FALSE(has("up.controllers_of_others")) << "expected one note, with one remedy";
  for (const Diagnostic& d : diagnostics_.all()) {
    if (d.rule == "up.controllers_generated") {
      EXPECT_NE(d.message.find("'wheel' is not a joint here"), std::string::npos) << d.message;
    }
  }
  EXPECT_TRUE(has("up.controllers_generated"));
}

TEST_F(RobotSetupTest, SimulationArgumentIsChosenAndReported) {
  write_robot("");
  EXPECT_NE(set_up().description.robot.find_link("arm true"), nullptr);
  EXPECT_TRUE(has("up.use_sim"));
  diagnostics_ = {};
  EXPECT_NE(set_up({{"use_sim", "false"}}).description.robot.find_link("arm false"), nullptr);
  EXPECT_FALSE(has("up.use_sim"));
}

TEST_F(RobotSetupTest, DescriptionBrokenBySimulationArgumentIsTakenWithout) {
  write("urdf/my_arm.urdf.xacro",
        "<robot name=\"my_arm\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">"
        "<xacro:arg name=\"use_sim\" default=\"false\"/><link name=\"base\"/>"
        "<xacro:if value=\"$(arg use_sim)\"><p f=\"$(find no_such_package)\"/></xacro:if></robot>");
  EXPECT_NE(set_up().description.robot.find_link("base"), nullptr);
  EXPECT_TRUE(has("up.use_sim"));
  EXPECT_THROW(set_up({{"use_sim", "true"}}), InputError) << "expected the user's choice not to be replaced";
}

TEST_F(RobotSetupTest, XacroFileIsExpandedWithoutPrefix) {
  write("urdf/my_arm.urdf.xacro", "<robot name=\"my_arm\"><link name=\"base${1 + 1}\"/></robot>");
  EXPECT_NE(set_up().description.robot.find_link("base2"), nullptr);
}

}  // namespace
}  // namespace doppel
