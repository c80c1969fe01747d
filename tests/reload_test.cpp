// Hot reload: an edit replaces the running machine, or leaves it unchanged.
#include <filesystem>
#include <fstream>
#include <map>

#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace fs = std::filesystem;

class TwinReloadTest : public TwinFixture {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / "reload" / info->name() /
              "omarm_one";  // alone: packages search their neighbours
    fs::remove_all(folder_);
    fs::create_directories(folder_.parent_path());
    fs::copy(DOPPEL_SOURCE_DIR "/robots/omarm_one", folder_, fs::copy_options::recursive);
    bring_up(folder_.string());
  }
  void TearDown() override {
    edge_.reset();
    twin_.reset();
    fs::remove_all(folder_);
  }

  void edit(const std::string& file, const std::string& from, const std::string& to) {
    std::ifstream in(folder_ / file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << "expected '" << from << "' in " << file;
    std::ofstream(folder_ / file) << text.replace(at, from.size(), to);
  }

  Twin::Reload reload() {
    Diagnostics said;
    const auto fresh = Twin::prepare(twin_->running(), said);
    return twin_->replace(fresh);
  }

  std::map<std::string, double> positions() {
    std::map<std::string, double> out;
    for (const JointSnapshot& j : twin_->robot().joints()) out[j.name] = j.q;
    return out;
  }

  void expect_state(const std::string& controller, ControllerState state) {
    for (const ControllerView& view : twin_->robot().controller_manager().controllers()) {
      if (view.name == controller) {
        EXPECT_EQ(view.state, state) << controller;
        return;
      }
    }
    ADD_FAILURE() << "expected " << controller << " to be loaded";
  }

  void send_trajectory() {
    publish("/omarm_arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
            R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.0, 1.2, 1.4, 1.5, 1.3, 1.1], time_from_start: {sec: 2}}]})");
  }

  fs::path folder_;
};

TEST_F(TwinReloadTest, TrajectoryContinuesThroughEditOfLimitsAndInertia) {
  send_trajectory();
  run(1.0);
  const auto before = positions();
  const Time time = twin_->now();
  edit("urdf/omarm.xacro", "velocity=\"5.2\"", "velocity=\"4.4\"");
  EXPECT_EQ(reload(), Twin::Reload::controllers_kept);
  EXPECT_EQ(twin_->now(), time);
  for (const auto& [name, q] : positions()) EXPECT_NEAR(q, before.at(name), 1e-6) << name;
  EXPECT_EQ(twin_->robot()
                .model()
                .joints[static_cast<std::size_t>(twin_->robot().model().find_joint("Revolute 1"))]
                .velocity,
            4.4);
  run(0.002);
  for (const auto& [name, q] : positions())
    EXPECT_NEAR(q, before.at(name), 0.01) << "expected no jump of " << name;
  run(1.5);
  EXPECT_NEAR(joint("Revolute 1").q, 1.0, 0.01);
  EXPECT_NEAR(joint("Revolute 3").q, 1.4, 0.01);
}

TEST_F(TwinReloadTest, EffortLimitBelowLoadIsReported) {
  std::string warnings;
  log_.add_sink([&](const LogLine& line) {
    if (line.severity == Severity::warning) warnings += line.text + '\n';
  });
  run(0.6);
  edit("urdf/omarm.xacro", "velocity=\"5.2\"", "velocity=\"4.4\"");
  reload();
  EXPECT_EQ(warnings.find("is below its load"), std::string::npos) << warnings;
  ASSERT_FALSE(twin_->robot().gravity_sag().empty());
  std::string text;
  {
    std::ifstream in(folder_ / "urdf/omarm.xacro");
    text = {std::istreambuf_iterator<char>(in), {}};
  }
  for (std::size_t at = text.find("effort=\"3.5\""); at != std::string::npos;
       at = text.find("effort=\"3.5\""))
    text.replace(at, 12, "effort=\"0.01\"");
  std::ofstream(folder_ / "urdf/omarm.xacro") << text;
  reload();
  EXPECT_NE(warnings.find("after the edit, the effort limit 0.01 N m of 'Revolute 3' is below its load"),
            std::string::npos)
      << warnings;
  const std::string once = warnings;
  edit("urdf/omarm.xacro", "velocity=\"4.4\"", "velocity=\"5.2\"");
  reload();
  EXPECT_EQ(warnings, once) << "it is reported again";
}

TEST_F(TwinReloadTest, LostLimitIsRefused) {
  send_trajectory();
  run(3.0);
  edit("urdf/omarm.xacro", "upper=\"3.141593\"", "uper=\"3.141593\"");
  EXPECT_THROW(reload(), InputError);
  run(0.5);
  EXPECT_NEAR(joint("Revolute 1").q, 1.0, 0.01);
}

TEST_F(TwinReloadTest, LimitExcludingPositionIsRefused) {
  send_trajectory();
  run(3.0);
  edit("urdf/omarm.xacro", "upper=\"3.141593\"", "upper=\"0.5\"");
  try {
    reload();
    FAIL() << "expected an InputError: the joint is at 1";
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics().front().rule, "reload.limits");
    EXPECT_NE(std::string(error.what()).find("omarm.xacro:"), std::string::npos) << error.what();
  }
  run(0.5);
  EXPECT_NEAR(joint("Revolute 1").q, 1.0, 0.01);
}

TEST_F(TwinReloadTest, EditWithoutEffectKeepsMotion) {
  run(1.0);
  const auto before = positions();
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(reload(), Twin::Reload::controllers_kept);
    run(0.1);
  }
  for (const auto& [name, q] : positions())
    EXPECT_NEAR(q, before.at(name), 1e-5) << "expected no motion of " << name;
}

TEST_F(TwinReloadTest, ControllersYamlIsReadAgain) {
  run(0.2);
  const auto before = positions();
  edit("config/ros2_controllers.yaml", "update_rate: 100", "update_rate: 200");
  EXPECT_EQ(reload(), Twin::Reload::controllers_recreated);
  EXPECT_EQ(twin_->robot().controller_manager().period(), Duration(5'000'000));
  for (const char* name : {"omarm_arm_controller", "omarm_gripper_controller", "joint_state_broadcaster"})
    expect_state(name, ControllerState::active);
  for (const auto& [name, q] : positions()) EXPECT_NEAR(q, before.at(name), 1e-6) << name;
  send_trajectory();
  run(3.0);
  EXPECT_NEAR(joint("Revolute 2").q, 1.2, 0.01);
}

TEST_F(TwinReloadTest, StoppedControllerStaysStopped) {
  call("/controller_manager/switch_controller", "controller_manager_msgs/srv/SwitchController",
       "{deactivate_controllers: [omarm_gripper_controller], strictness: 2}");
  run(0.1);
  expect_state("omarm_gripper_controller", ControllerState::inactive);
  edit("config/ros2_controllers.yaml", "update_rate: 100", "update_rate: 50");
  reload();
  expect_state("omarm_gripper_controller", ControllerState::inactive);
  expect_state("omarm_arm_controller", ControllerState::active);
}

TEST_F(TwinReloadTest, ServicesTopicsAndPauseAreKept) {
  twin_->time_control().paused = true;
  twin_->time_control().speed = 0.5;
  const std::uint64_t steps = twin_->steps();
  edit("config/ros2_controllers.yaml", "update_rate: 100", "update_rate: 50");
  reload();
  EXPECT_TRUE(twin_->time_control().paused);
  EXPECT_EQ(twin_->time_control().speed, 0.5);
  EXPECT_EQ(twin_->steps(), steps);
  EXPECT_NE(call("/controller_manager/list_controllers", "controller_manager_msgs/srv/ListControllers", "{}")
                .find("omarm_arm_controller"),
            std::string::npos);
}

TEST_F(TwinReloadTest, NewOverlayIsApplied) {
  run(0.2);
  std::ofstream(folder_ / "urdf/omarm.overlay.yaml")
      << "- set_limit: Revolute 1\n  velocity: 2.5\n  was: {velocity: 5.2}\n";
  EXPECT_EQ(reload(), Twin::Reload::controllers_kept);
  EXPECT_EQ(twin_->robot()
                .model()
                .joints[static_cast<std::size_t>(twin_->robot().model().find_joint("Revolute 1"))]
                .velocity,
            2.5);
}

TEST_F(TwinReloadTest, InvalidEditChangesNothing) {
  run(0.5);
  const auto before = positions();
  const std::string text = "<mimic joint=\"Revolute 8\"";
  edit("urdf/omarm.xacro", text, "<mimic joint=\"Revolute 88\"");
  EXPECT_THROW(reload(), InputError);
  edit("urdf/omarm.xacro", "<mimic joint=\"Revolute 88\"", text);
  edit("urdf/omarm.xacro", "<robot", "<robot <");
  EXPECT_THROW(reload(), InputError);
  edit("urdf/omarm.xacro", "<robot <", "<robot");
  edit("config/ros2_controllers.yaml", "ros__parameters:", "ros__parameters: [");
  EXPECT_THROW(reload(), InputError);
  edit("config/ros2_controllers.yaml", "ros__parameters: [", "ros__parameters:");
  edit("config/ros2_controllers.yaml", "\"Revolute 8\"", "\"Revolute 7\"");
  EXPECT_THROW(reload(), InputError);
  for (const auto& [name, q] : positions()) EXPECT_NEAR(q, before.at(name), 1e-6) << name;
  run(0.5);
  expect_state("omarm_arm_controller", ControllerState::active);
  for (const auto& [name, q] : positions()) EXPECT_NEAR(q, before.at(name), 1e-4) << name;
}

// Rejected before anything running is destroyed: the run continues bit by bit as if there had been no edit.
TEST_F(TwinReloadTest, RefusedPublisherParametersKeepOldRobot) {
  send_trajectory();
  run(1.0);
  const std::uint64_t undisturbed = twin_->state_hash();
  bring_up(folder_.string());
  send_trajectory();
  run(0.4);
  const fs::path file = folder_ / "config/ros2_controllers.yaml";
  std::ofstream(file, std::ios::app)
      << "\nrobot_state_publisher:\n  ros__parameters:\n    publish_frequency: -5.0\n";
  EXPECT_THROW(reload(), InputError);
  run(0.6);
  EXPECT_EQ(twin_->state_hash(), undisturbed);
}

// Found by search, not named: the controllers that it declares are not replaced by generated ones.
TEST_F(TwinReloadTest, LostControllersFileIsRefusedUntilRestored) {
  const fs::path file = folder_ / "config/ros2_controllers.yaml";
  std::ifstream in(file);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  const auto before = twin_->robot().controller_manager().controllers().size();
  const auto expect_refused = [&](const std::string& what) {
    EXPECT_THROW(reload(), InputError) << what;
    EXPECT_EQ(twin_->robot().controller_manager().controllers().size(), before) << what;
    const auto watched = twin_->files();
    EXPECT_NE(std::find(watched.begin(), watched.end(), file), watched.end()) << what;
  };
  std::ofstream(file) << "";
  expect_refused("empty");
  std::ofstream(file) << "controller_manager:\n  update_rate: 100\n";
  expect_refused("without ros__parameters");
  std::ofstream(file) << "some_node:\n  ros__parameters:\n    rate: 100\n";
  expect_refused("of another node");
  fs::remove(file);
  expect_refused("deleted");
  std::ofstream(file) << whole;
  EXPECT_NO_THROW(reload());
  edit("config/ros2_controllers.yaml", "update_rate: ", "update_rate: 1");
  EXPECT_EQ(reload(), Twin::Reload::controllers_recreated);
}

TEST_F(TwinReloadTest, EveryUsedFileIsWatched) {
  std::map<std::string, int> names;
  for (const fs::path& file : twin_->files()) ++names[file.filename().string()];
  for (const char* name : {"omarm.xacro", "materials.xacro", "omarm.ros2control", "omarm.gazebo",
                           "ros2_controllers.yaml", "omarm.overlay.yaml", "link_1_1.stl"})
    EXPECT_GT(names[name], 0) << name;
}

}  // namespace
}  // namespace doppel::test
