// A scenario with all choices of a twin, written to a file and started again.
#include <gmock/gmock.h>

#include <fstream>

#include "doppel/scenario/schema/scenario_file.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Notes and warnings about what is guessed.
constexpr const char* kGuesses[] = {"up.use_sim",
                                    "up.base_fixed",
                                    "up.base_floating",
                                    "up.controllers_chosen",
                                    "up.base_generated",
                                    "up.controllers_of_others",
                                    "up.controllers_generated",
                                    "up.hardware_generated",
                                    "up.namespace_given",
                                    "up.joints_held",
                                    "control.step_chosen",
                                    "model.no_inertial"};

class ScenarioRun : public TwinFixture {
 protected:
  ScenarioRun() {
    log_.add_sink([this](const LogLine& line) { logged_ += line.text + '\n'; });
  }

  [[nodiscard]] std::vector<std::string> guesses() const {
    std::vector<std::string> out;
    for (const char* const rule : kGuesses) {
      const auto is = [rule](const Diagnostic& d) { return d.rule == rule; };
      if (std::ranges::any_of(diagnostics_.all(), is) || logged_.find(rule) != std::string::npos)
        out.emplace_back(rule);
    }
    return out;
  }

  struct Outcome {
    std::vector<std::string> guesses, controllers;
    std::uint64_t state_hash = 0;
    std::string content_hash, text;
  };
  Outcome outcome_of(const Scenario& scenario, const fs::path& folder) {
    logged_.clear();
    bring_up(scenario);
    Outcome out;
    const Scenario complete = twin_->complete_scenario();
    const std::vector<ReadFile> files = files_with_hashes(twin_->files());
    out.text = scenario_text(complete, files, folder, ScenarioFormat::yaml);
    out.content_hash = content_hash(complete, files, folder);
    for (const auto& robot : twin_->robots())
      for (const ControllerView& one : robot->controller_manager().controllers())
        out.controllers.push_back(robot->name() + "/" + one.name + " " + std::string(to_string(one.state)));
    run(0.2);
    out.guesses = guesses();
    out.state_hash = twin_->state_hash();
    return out;
  }

  // Runs a scenario and the one that it writes.
  void expect_same(const Scenario& scenario, bool guesses = true) {
    const fs::path folder = make_folder("scenario_run");
    const Outcome first = outcome_of(scenario, folder);
    SCOPED_TRACE(first.text);
    EXPECT_EQ(!first.guesses.empty(), guesses);
    std::ofstream(folder / "run.yaml") << first.text;
    const ScenarioFile written = load_scenario(folder / "run.yaml", scenario.bundled_robots);
    const Outcome again = outcome_of(written.scenario, folder);
    EXPECT_THAT(again.guesses, ::testing::IsEmpty());
    EXPECT_EQ(again.controllers, first.controllers);
    EXPECT_EQ(again.state_hash, first.state_hash);
    EXPECT_EQ(again.content_hash, written.content_hash);
    EXPECT_EQ(again.text, first.text);
    Diagnostics changed;
    report_changed_files(written, changed);
    EXPECT_TRUE(changed.all().empty());
  }
  void expect_same(const std::string& target, bool guesses = true) {
    Scenario scenario;
    scenario.robots = {{.target = target}};
    expect_same(scenario, guesses);
  }

  std::string logged_;
};

class BundledScenario : public ScenarioRun, public ::testing::WithParamInterface<const char*> {};

TEST_P(BundledScenario, WrittenOneGuessesNothingAndHasSameHash) {
  const std::string robot = GetParam();
  expect_same(robot,
              robot != "omarm_zero");  // its root is a link 'world', and a plugin names its controllers
}

INSTANTIATE_TEST_SUITE_P(Robots, BundledScenario,
                         ::testing::Values("ackermann_car", "kate", "lab_arm", "omarm_one", "omarm_zero",
                                           "rover_mecanum", "rover_skid", "turtle"),
                         [](const auto& robot) { return std::string(robot.param); });

TEST_F(ScenarioRun, RobotsOfWorldFileAreWrittenOnce) {
  Scenario scenario;
  scenario.world = DOPPEL_SOURCE_DIR "/worlds/two_arms.yaml";
  expect_same(scenario);
  EXPECT_EQ(twin_->robots().size(), 2u);
}

TEST_F(ScenarioRun, WorldWithObjectsHasSameHash) {
  Scenario scenario;
  scenario.robots = {{.target = "omarm_one"}};
  scenario.world = DOPPEL_SOURCE_DIR "/worlds/table.yaml";
  expect_same(scenario);
}

TEST_F(ScenarioRun, SecondRobotKeepsItsGeneratedNamespace) {
  Scenario scenario;
  scenario.robots = {{.target = "lab_arm"}, {.target = "lab_arm", .X_WR = make_pose({1, 0, 0}, {0, 0, 0.3})}};
  expect_same(scenario);
}

TEST_F(ScenarioRun, ControllersThatAreNotStartedStayInactive) {
  Scenario scenario;
  scenario.robots = {{.target = "lab_arm", .activate = {"joint_state_broadcaster"}}};
  expect_same(scenario);
}

// Without masses, controllers, hardware and limits.
constexpr const char* kBareArm = R"(<robot name="bare">
  <link name="base"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="5" velocity="2"/></joint>
  <link name="upper">
    <collision><origin xyz="0 0 0.15"/><geometry><box size="0.05 0.05 0.3"/></geometry></collision></link>
  <joint name="b" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="0 0 0.3" rpy="0 0.1 0"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="5" velocity="2"/></joint>
  <link name="lower"/>
</robot>)";

TEST_F(ScenarioRun, EstimatedMassesAreWrittenWithAllBits) {
  const fs::path folder = make_folder("bare_arm");
  std::ofstream(folder / "bare.urdf") << kBareArm;
  expect_same((folder / "bare.urdf").string());
  EXPECT_TRUE(twin_->robot().machine().has_generated_hardware());
}

TEST_F(ScenarioRun, FoundControllersAndGeneratedOnesAreWritten) {
  const fs::path folder = make_folder("found");
  fs::create_directories(folder / "config");
  std::ofstream(folder / "package.xml") << "<package><name>found</name></package>";
  fs::create_directories(folder / "urdf");
  std::ofstream(folder / "urdf/bare.urdf") << kBareArm;
  std::ofstream(folder / "config/controllers.yaml") << R"(
controller_manager:
  ros__parameters:
    update_rate: 150
    one: {type: joint_trajectory_controller/JointTrajectoryController}
    broken: {type: there_is/None}
one:
  ros__parameters: {joints: [a], command_interfaces: [position], state_interfaces: [position]}
)";
  expect_same((folder / "urdf/bare.urdf").string());
  EXPECT_THAT(logged_, ::testing::Not(HasSubstr("no loaded controller")));
  EXPECT_EQ(twin_->robot().controller_manager().controllers().size(), 3u);
}

TEST_F(ScenarioRun, CompleteScenarioWithoutBaseIsRefused) {
  Scenario scenario;
  scenario.complete = true;
  scenario.robots = {{.target = "kate"}};
  scenario.choices[""] = {};
  EXPECT_THROW(bring_up(scenario), InputError);
}

TEST_F(ScenarioRun, MassOfUnknownLinkIsRefusedWithNearestOne) {
  Scenario scenario;
  RobotChoices choices;
  choices.masses["bas"] = {};
  const fs::path folder = make_folder("bare_arm");
  std::ofstream(folder / "bare.urdf") << kBareArm;
  scenario.robots = {{.target = (folder / "bare.urdf").string(), .base = BaseKind::fixed}};
  scenario.choices[""] = choices;
  try {
    bring_up(scenario);
    FAIL() << "expected an InputError";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'base'?"));
  }
}

}  // namespace
}  // namespace doppel::test
