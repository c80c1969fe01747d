#include "doppel/scenario/schema/scenario_file.h"

#include <gmock/gmock.h>

#include <fstream>

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class ScenarioFileTest : public testing::Test {
 protected:
  ScenarioFileTest() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / "scenario_file" / info->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "config");
  }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  [[nodiscard]] Scenario loaded(const std::string& text, const std::vector<std::string>& plugins = {}) const {
    return load_scenario(write("run.yaml", text), "/robots", plugins).scenario;
  }
  [[nodiscard]] std::string error_of(const std::string& text) const {
    try {
      static_cast<void>(loaded(text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  // With a value other than the default in every field.
  [[nodiscard]] Scenario full() const {
    Scenario out;
    out.complete = true;
    out.step = Duration(666'667);
    out.world = write("world.yaml", "name: x\n");
    out.engine = "bullet";
    out.start_controllers = false;
    out.plugins = {write("libmine.so", "")};
    out.ideal = true;
    out.enforce_limits = false;
    out.strict = true;
    out.wall_stamps = true;
    out.sensors = {.seed = 18'446'744'073'709'551'615u, .lockstep = true, .threads = 3};
    write("params.yaml", "");
    std::vector<std::string> words{"--ros-args",
                                   "-r",
                                   "/clock:=clock",
                                   "-p",
                                   "arm:gain:=[1.5, 2.0]",
                                   "--params-file",
                                   (folder_ / "params.yaml").string(),
                                   "--log-level",
                                   "warn",
                                   "--enclave",
                                   "/left"};
    out.ros = take_ros_arguments(words);
    WorldRobot& robot = out.robots.emplace_back();
    robot.target = write("arm one.urdf", "<robot/>");
    robot.name_space = "fleet/left";
    robot.X_WR = make_pose({0.1, -2e-7, 1.0 / 3.0}, {0.3, -0.2, 2.5});
    robot.arguments = {{"use_sim", "true"}, {"name", "a: b #c"}};
    robot.base = BaseKind::floating;
    robot.tf = TfTopics::separate;
    RobotChoices& choices = out.choices[robot.name_space];
    choices.controllers = {write("config/a.yaml", ""), write("config/b.yaml", "")};
    choices.parameters = {"a:\n  b: [1, 2]\n", "c: \"x\ty\"\n"};
    choices.active = {"joint_state_broadcaster", "arm-1"};
    choices.inactive = {"no"};
    choices.generated_hardware = true;
    MassProperties mass{1.0 / 7.0, {0.1, 1e-17, -3}, {}};
    mass.I << 1.0 / 3.0, 1e-5, -2e-5, 1e-5, 0.5, 3e-5, -2e-5, 3e-5, 0.7;
    choices.masses.emplace("Link 1", mass);
    return out;
  }

  fs::path folder_;
};

TEST_F(ScenarioFileTest, EveryValueIsReadAsWrittenInBothFormats) {
  const Scenario before = full();
  for (const ScenarioFormat format : {ScenarioFormat::yaml, ScenarioFormat::json}) {
    const std::string text = scenario_text(before, {}, folder_, format);
    SCOPED_TRACE(text);
    const Scenario after = loaded(text, before.plugins);
    EXPECT_EQ(scenario_text(after, {}, folder_, format), text);
    ASSERT_EQ(after.robots.size(), 1u);
    const WorldRobot &robot = after.robots[0], &as_given = before.robots[0];
    EXPECT_EQ(fs::path(robot.target), fs::path(as_given.target));
    EXPECT_EQ(robot.X_WR->matrix(), as_given.X_WR->matrix()) << "expected the same bits";
    EXPECT_EQ(robot.arguments, as_given.arguments);
    const RobotChoices &choices = after.choices.at("fleet/left"), &chosen = before.choices.at("fleet/left");
    EXPECT_EQ(choices.parameters, chosen.parameters);
    EXPECT_EQ(choices.inactive, chosen.inactive);
    EXPECT_EQ(choices.masses.at("Link 1").I, chosen.masses.at("Link 1").I);
    EXPECT_EQ(after.step, before.step);
    EXPECT_EQ(after.sensors.seed, before.sensors.seed);
    EXPECT_EQ(after.bundled_robots, "/robots");
  }
}

TEST_F(ScenarioFileTest, MirrorIsReadAsWritten) {
  Scenario before = full();
  before.hardware = HardwareUse::real;
  for (const MirrorMode mode :
       {MirrorMode::shadow, MirrorMode::follow, MirrorMode::off, MirrorMode::rehearse}) {
    before.mirror = mode;
    for (const ScenarioFormat format : {ScenarioFormat::yaml, ScenarioFormat::json})
      EXPECT_EQ(loaded(scenario_text(before, {}, folder_, format), before.plugins).mirror, mode);
  }
  before.hardware = HardwareUse::emulated;
  EXPECT_EQ(loaded(scenario_text(before, {}, folder_, ScenarioFormat::yaml), before.plugins).mirror,
            MirrorMode::rehearse);
  EXPECT_THAT(error_of("doppel_scenario: 1\nhardware: real\nmirror: rehears\n"),
              HasSubstr("did you mean 'rehearse'"));
}

TEST_F(ScenarioFileTest, EmulationIsReadAsWritten) {
  Scenario before = full();
  before.hardware = HardwareUse::ports;
  before.guard = false;
  before.emulation = {.faults = write("faults.yaml", "faults: []"),
                      .seed = 7,
                      .hand = HandMotion::sweep,
                      .servos = ServoProtocol::dynamixel,
                      .trace = {}};
  for (const ScenarioFormat format : {ScenarioFormat::yaml, ScenarioFormat::json}) {
    const Scenario after = loaded(scenario_text(before, {}, folder_, format), before.plugins);
    EXPECT_EQ(after.hardware, HardwareUse::ports);
    EXPECT_FALSE(after.guard);
    EXPECT_EQ(after.emulation.faults, before.emulation.faults);
    EXPECT_EQ(after.emulation.seed, 7u);
    EXPECT_EQ(after.emulation.hand, HandMotion::sweep);
    EXPECT_EQ(after.emulation.servos, ServoProtocol::dynamixel);
  }
  EXPECT_THAT(error_of("doppel_scenario: 1\nhardware: ports\nemulation: {servos: fetech}\n"),
              HasSubstr("did you mean 'feetech'?"));
}

TEST_F(ScenarioFileTest, PathsFollowFolder) {
  const Scenario before = full();
  const std::string text = scenario_text(before, {}, folder_, ScenarioFormat::yaml);
  EXPECT_THAT(text, testing::Not(HasSubstr(folder_.string())));
  const fs::path moved = folder_.parent_path() / "moved";
  fs::remove_all(moved);
  fs::copy(folder_, moved, fs::copy_options::recursive);
  std::ofstream(moved / "run.yaml") << text;
  const std::string plugin = moved / "libmine.so";
  const Scenario after = load_scenario(moved / "run.yaml", "", {plugin}).scenario;
  EXPECT_EQ(fs::path(after.robots[0].target), moved / "arm one.urdf");
  EXPECT_EQ(content_hash(after, {}, moved), content_hash(before, {}, folder_));
}

TEST_F(ScenarioFileTest, LibraryIsThatOfUserAndNeverThatOfFile) {
  write("liba.so", "");
  const std::string text =
      "doppel_scenario: 1\nrobots: [{robot: omarm_one}]\nplugins: [liba.so, lib/libb.so]\n";
  EXPECT_THAT(error_of(text),
              AllOf(HasSubstr("run.yaml:3"), HasSubstr("a file alone does not load code"),
                    HasSubstr("--plugin FOLDER/liba.so"), HasSubstr("--plugin FOLDER/libb.so")));
  const std::vector<std::string> named{"/usr/lib/libb.so", "build/liba.so"};
  EXPECT_THAT(loaded(text, named).plugins, testing::ElementsAre("build/liba.so", "/usr/lib/libb.so"));
  EXPECT_THAT(
      [&] {
        static_cast<void>(loaded(text, {"liba.so", "libb.so", "libc.so"}));
      },
      testing::ThrowsMessage<InputError>(HasSubstr("does not need the library 'libc.so'")));
  EXPECT_THAT([&] { static_cast<void>(loaded("doppel_scenario: 1\n", {"liba.so"})); },
              testing::ThrowsMessage<InputError>(HasSubstr("does not need the library 'liba.so'")));
}

TEST_F(ScenarioFileTest, NoKeyNamesFileThatRunWouldWrite) {
  Scenario scenario = full();
  scenario.hardware = HardwareUse::ports;
  scenario.emulation.trace = folder_ / "bus.txt";
  EXPECT_THAT(scenario_text(scenario, {}, folder_, ScenarioFormat::yaml), testing::Not(HasSubstr("bus.txt")));
  EXPECT_THAT(error_of("doppel_scenario: 1\nhardware: ports\nemulation: {trace: bus.txt}\n"),
              HasSubstr("'trace'"));
}

TEST_F(ScenarioFileTest, NamesOfBundledRobotsAndWorldsAreKept) {
  const Scenario scenario = loaded("doppel_scenario: 1\nrobots: [{robot: omarm_one}]\nworld: table\n");
  EXPECT_EQ(scenario.robots[0].target, "omarm_one");
  EXPECT_EQ(*scenario.world, "table");
  EXPECT_FALSE(scenario.complete);
  EXPECT_TRUE(scenario.choices.empty());
  EXPECT_THAT(scenario_text(scenario, {}, folder_, ScenarioFormat::yaml),
              AllOf(HasSubstr("robot: omarm_one\n"), HasSubstr("world: table\n")));
}

TEST_F(ScenarioFileTest, UnknownKeyHasPlaceAndNearestKey) {
  EXPECT_THAT(error_of("doppel_scenario: 1\nengin: bullet\n"),
              HasSubstr("run.yaml:2:1: error: a scenario has no key 'engin'; did you mean 'engine'?"));
  EXPECT_THAT(error_of("doppel_scenario: 1\nrobots:\n  - robot: a\n    bse: fixed\n"),
              HasSubstr("run.yaml:4:5: error: a robot has no key 'bse'; did you mean 'base'?"));
}

TEST_F(ScenarioFileTest, AllErrorsAreReportedTogether) {
  EXPECT_THAT(error_of("doppel_scenario: 1\nstep: 5\nideal: perhaps\nstamp: wal\nrobots: [{base: fixed}]\n"
                       "sensors: {seed: -1}\nros_args: [-q]\n"),
              AllOf(HasSubstr("step is 5 s"), HasSubstr("ideal must be true or false, not 'perhaps'"),
                    HasSubstr("did you mean 'wall'?"), HasSubstr("a robot needs the key 'robot'"),
                    HasSubstr("seed must be a whole number"), HasSubstr("'-q' is not an argument")));
}

TEST_F(ScenarioFileTest, CompleteScenarioNeedsChoicesOfEachRobot) {
  EXPECT_THAT(error_of("doppel_scenario: 1\ncomplete: true\nrobots:\n  - robot: omarm_one\n"),
              HasSubstr("run.yaml:4:5: error: the scenario is complete, but this robot has no choices"));
}

TEST_F(ScenarioFileTest, OtherVersionIsRefused) {
  EXPECT_THAT(error_of("doppel_scenario: 2\n"), HasSubstr("version 2 of a scenario, but 1 is known"));
}

TEST_F(ScenarioFileTest, MassWithoutInertiaIsError) {
  EXPECT_THAT(error_of("doppel_scenario: 1\nrobots:\n  - robot: a\n    choices: {masses: {l: {mass: -1}}}\n"),
              AllOf(HasSubstr("mass must be positive"), HasSubstr("inertia must be a list of 6 numbers")));
}

TEST_F(ScenarioFileTest, MissingMassAndInertiaAreErrorsAtLink) {
  const std::string error =
      error_of("doppel_scenario: 1\nrobots:\n  - robot: a\n    choices: {masses: {l: {com: [0, 0, 0]}}}\n");
  EXPECT_THAT(error, AllOf(HasSubstr("run.yaml:4:27: error: mass must be a number"),
                           HasSubstr("run.yaml:4:27: error: inertia must be a list of 6 numbers")));
}

TEST_F(ScenarioFileTest, RotationThatIsNoneIsError) {
  EXPECT_THAT(
      error_of("doppel_scenario: 1\nrobots:\n  - {robot: a, rotation: [2, 0, 0, 0, 1, 0, 0, 0, 1]}\n"),
      HasSubstr("nine numbers of a rotation matrix"));
}

TEST_F(ScenarioFileTest, OnlyFilesWithKeyAreScenarios) {
  EXPECT_TRUE(is_scenario_file(write("a.yaml", "# my run\ndoppel_scenario: 1\n")));
  EXPECT_TRUE(is_scenario_file(write("a.json", "{\"doppel_scenario\": 1}")));
  EXPECT_FALSE(is_scenario_file(write("world.yaml", "name: doppel_scenario\n")));
  EXPECT_FALSE(is_scenario_file(folder_));
  EXPECT_FALSE(is_scenario_file(folder_ / "none.yaml"));
}

TEST_F(ScenarioFileTest, ChangedRemovedAndNewFilesAreNotes) {
  const fs::path same = write("same.urdf", "1"), changed = write("changed.urdf", "1"),
                 removed = write("removed.urdf", "1"), created = folder_ / "created.urdf";
  const std::vector<ReadFile> files = files_with_hashes({same, changed, removed, created, same});
  ASSERT_EQ(files.size(), 4u);
  EXPECT_EQ(files[3].sha256, kNoFile);
  const std::string text = scenario_text({}, files, folder_, ScenarioFormat::yaml);
  const std::string hash = content_hash({}, files, folder_);
  write("changed.urdf", "2");
  write("created.urdf", "");
  fs::remove(removed);
  const ScenarioFile read = load_scenario(write("run.yaml", text), "");
  EXPECT_EQ(read.content_hash, hash);
  Diagnostics notes;
  report_changed_files(read, notes);
  ASSERT_EQ(notes.all().size(), 3u);
  EXPECT_THAT(notes.all()[0].str(),
              AllOf(HasSubstr("run.yaml:"), HasSubstr("changed.urdf' has changed since")));
  EXPECT_THAT(notes.all()[1].str(), HasSubstr("removed.urdf' no longer exists"));
  EXPECT_THAT(notes.all()[2].str(), HasSubstr("created.urdf' exists now"));
  EXPECT_NE(content_hash({}, files_with_hashes({same, changed, removed, created}), folder_), hash);
}

TEST_F(ScenarioFileTest, EachValueChangesHash) {
  const std::string hash = content_hash({}, {}, folder_);
  Scenario other;
  other.sensors.seed = 1;
  EXPECT_NE(content_hash(other, {}, folder_), hash);
  other = {};
  other.strict = true;
  EXPECT_NE(content_hash(other, {}, folder_), hash);
  EXPECT_EQ(content_hash({}, {}, folder_), hash);
}

}  // namespace
}  // namespace doppel
