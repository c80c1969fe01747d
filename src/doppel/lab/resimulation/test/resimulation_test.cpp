// Recorded runs that are run again: equal hashes for every bundled robot and engine, under random clients,
// an edit, spawned robots and resets; and the first difference where something is not the same.
#include "doppel/lab/resimulation/resimulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/lab/recording/run_files.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/ros/bus/parameter_services.h"
#include "doppel/ros/bus/rosout.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/rosbag2_interfaces.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "doppel/ros/messages/type_description_interfaces.h"
#include "doppel/ros/record/bag_copy.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

const fs::path kRobots = DOPPEL_SOURCE_DIR "/robots";

Scenario scenario_of(const std::string& target, const std::string& engine = "mujoco") {
  Scenario scenario;
  scenario.bundled_robots = kRobots;
  scenario.robots = {{.target = target}};
  scenario.engine = engine;
  return scenario;
}

class ResimulationTest : public testing::Test {
 protected:
  ResimulationTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ResimulationTest() override { fs::remove_all(folder_); }

  // Steps a twin of the scenario; `act` is called before each step. Returns the twin's hash.
  std::uint64_t record(const Scenario& scenario, std::uint64_t steps,
                       const std::function<void(Twin&, Edge&, std::uint64_t)>& act) {
    Diagnostics diagnostics;
    Twin twin(scenario, log_, diagnostics);
    RunRecordingOptions options;
    options.bag.folder = bag_;
    options.keeps_states = true;
    twin.keep_states(true);
    BusRecorder recorder(twin.bus(), run_recorder_options(twin, options, log_), log_);
    const auto edge = twin.bus().attach("client");
    HeadlessOptions headless;
    headless.until = [&](Twin&) {
      if (twin.steps_taken() >= steps) return true;
      act(twin, *edge, twin.steps_taken());
      recorder.let_catch_up();
      return false;
    };
    while (twin.steps_taken() < steps) {
      const RunResult result = run_headless(twin, headless);
      EXPECT_NE(result.end, RunEnd::failed) << (result.errors.empty() ? "" : result.errors[0].str());
      if (result.end != RunEnd::diverged) break;
      act(twin, *edge, twin.steps_taken());
      twin.between_steps();
      if (twin.diverged()) break;
    }
    EXPECT_THAT(recorder.stop().failure, IsEmpty());
    EXPECT_THAT(recorder.stop().lost, IsEmpty());
    return twin.state_hash();
  }

  RecordedRun read() {
    bag_reader_.emplace(bag_.string());
    const fs::path files = folder_ / "files";
    fs::remove_all(files);
    fs::create_directories(files);
    return read_recorded_run(*bag_reader_, files, kRobots);
  }

  void expect_equal() {
    const RecordedRun run = read();
    ResimulationOptions options;
    options.compare_with = &*bag_reader_;
    const Resimulation result = resimulate(run, options);
    EXPECT_TRUE(result.run.errors.empty()) << result.run.errors[0].str();
    EXPECT_FALSE(result.wrong_after) << *result.wrong_after;
    EXPECT_FALSE(result.first) << result.first->topic << " at step " << result.first->step;
    EXPECT_THAT(result.failed_inputs, IsEmpty());
    EXPECT_EQ(result.compared, run.hashes.size());
    EXPECT_EQ(run.lost_inputs, 0U);
    EXPECT_TRUE(result.equal());
    inputs_ = run.inputs.size();
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("resimulation_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  const fs::path bag_ = folder_ / "bag";
  Log log_;
  std::optional<BagReader> bag_reader_;
  std::size_t inputs_ = 0;
};

// A repeated run would open the port, and repeat the commands on the arm.
TEST_F(ResimulationTest, RunWithRealHardwareIsRefused) {
  Scenario scenario = scenario_of("omarm_zero");
  scenario.hardware = HardwareUse::real;
  record(scenario, 5, [](Twin&, Edge&, std::uint64_t) {});
  try {
    static_cast<void>(read());
    FAIL() << "it is read";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("it is of real hardware"));
  }
}

// A client that sends something else each time: trajectories, velocities, parameters, services that change
// the world.
class RandomClient {
 public:
  RandomClient(Twin& twin, Edge& edge, std::uint32_t seed) : twin_(twin), edge_(edge), random_(seed) {}

  void act() {
    using Action = void (RandomClient::*)();
    constexpr Action kActions[] = {
        &RandomClient::trajectory, &RandomClient::velocity, &RandomClient::parameter,
        &RandomClient::reset,      &RandomClient::push,     &RandomClient::save,
        &RandomClient::restore,    &RandomClient::rewind,   &RandomClient::mistake};
    (this->*kActions[random_() % std::size(kActions)])();
  }

 private:
  double number() { return std::uniform_real_distribution(-1.0, 1.0)(random_); }
  void call(const std::string& service, const Bytes& request) {
    edge_.call(service, request, [](const Status&, const Bytes&) {});
  }

  void reset() { call("/gazebo/reset_simulation", to_cdr(std_srvs::srv::Empty::Request{})); }
  void save() { call("/doppel/save_state", to_cdr(doppel_msgs::srv::SaveState::Request{.name = "a"})); }
  void restore() { call("/doppel/restore_state", to_cdr(doppel_msgs::srv::RestoreState::Request{"a"})); }
  void rewind() { call("/doppel/rewind", to_cdr(doppel_msgs::srv::Rewind::Request{0.2})); }
  void mistake() { call("/doppel/nothing", {}); }

  void trajectory() {
    trajectory_msgs::msg::JointTrajectory message;
    for (const std::string& joint : twin_.robot().model().driven_joint_names())
      message.joint_names.push_back(joint);
    auto& point = message.points.emplace_back();
    for (std::size_t i = 0; i < message.joint_names.size(); ++i) point.positions.push_back(0.3 * number());
    point.time_from_start = to_duration_msg(from_seconds(0.2 + 0.2 * std::abs(number())));
    for (const TopicInfo& topic : twin_.bus().topics()) {
      if (topic.name.ends_with("/joint_trajectory"))
        static_cast<void>(edge_.publish("/client", topic.name, message.kType, to_cdr(message)));
    }
  }

  void velocity() {
    geometry_msgs::msg::Twist twist;
    twist.linear.x = number();
    twist.angular.z = number();
    for (const TopicInfo& topic : twin_.bus().topics()) {
      if (topic.name.find("cmd_vel") != std::string::npos)
        static_cast<void>(edge_.publish("/client", topic.name, twist.kType, to_cdr(twist)));
    }
  }

  void parameter() {
    twin_.bus().each_node([&](Node& node) {
      if (node.parameters().find("publish_rate") != nullptr)
        edge_.set_parameter(node.name(), "publish_rate", 20 + 10 * number(), [](const Status&) {});
    });
  }

  void push() {
    gazebo_msgs::srv::ApplyJointEffort::Request request;
    request.joint_name = twin_.robot().model().driven_joint_names().front();
    request.effort = 0.1 * number();
    request.duration = to_duration_msg(from_seconds(0.1));
    call("/gazebo/apply_joint_effort", to_cdr(request));
  }

  Twin& twin_;
  Edge& edge_;
  std::mt19937 random_;
};

struct RobotAndEngine {
  std::string robot, engine;
};
class EveryRobot : public ResimulationTest, public testing::WithParamInterface<RobotAndEngine> {};

TEST_P(EveryRobot, RandomClientGivesEqualHashesInSecondRun) {
  constexpr std::uint32_t kSeed = 4711;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::optional<RandomClient> client;
  record(scenario_of(GetParam().robot, GetParam().engine), 2500,
         [&](Twin& twin, Edge& edge, std::uint64_t step) {
           if (!client) client.emplace(twin, edge, kSeed);
           if (step % 41 == 0) client->act();
         });
  expect_equal();
  EXPECT_GE(inputs_, 10U);
}

std::vector<RobotAndEngine> robots_and_engines() {
  std::vector<RobotAndEngine> out;
  for (const fs::directory_entry& entry : fs::directory_iterator(kRobots)) {
    if (!fs::exists(entry.path() / "package.xml")) continue;
    for (const char* engine : {"mujoco", "bullet"}) out.push_back({entry.path().filename().string(), engine});
  }
  std::ranges::sort(out, {}, [](const RobotAndEngine& one) { return one.robot + one.engine; });
  return out;
}
INSTANTIATE_TEST_SUITE_P(Bundled, EveryRobot, testing::ValuesIn(robots_and_engines()),
                         [](const auto& one) { return one.param.robot + "_" + one.param.engine; });

TEST_F(ResimulationTest, SpawnedRobotJoinsAtItsRecordedStep) {
  std::ifstream urdf(kRobots / "lab_arm/urdf/lab_arm.urdf");
  bool answered = false;
  std::uint64_t joined = 0;
  record(scenario_of("omarm_zero"), 3000, [&](Twin& twin, Edge& edge, std::uint64_t step) {
    if (step == 500) {
      gazebo_msgs::srv::SpawnEntity::Request request;
      request.name = "second";
      request.robot_namespace = "second";
      request.xml =
          "<robot name=\"second\"><link name=\"base\"/><link name=\"a\"><inertial><mass value=\"1\"/>"
          "<inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial></link>"
          "<joint name=\"j\" type=\"revolute\"><parent link=\"base\"/><child link=\"a\"/><axis xyz=\"0 1 "
          "0\"/>"
          "<limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"2\"/></joint></robot>";
      request.initial_pose.position.x = 2;
      edge.call("/spawn_entity", to_cdr(request), [&](const Status& status, const Bytes&) {
        EXPECT_TRUE(status) << status.why();
        answered = true;
        joined = twin.steps_taken();
      });
    }
    // A headless run would be over before the robot is built.
    if (step == 2000 && !answered) twin.bus().wait(std::chrono::seconds(20));
  });
  ASSERT_TRUE(answered);
  EXPECT_GE(joined, 500U);
  expect_equal();
}

TEST_F(ResimulationTest, DivergenceAndResetAreRepeated) {
  record(scenario_of("lab_arm"), 2000, [&](Twin& twin, Edge& edge, std::uint64_t step) {
    if (step == 700) {
      gazebo_msgs::srv::ApplyJointEffort::Request request;
      request.joint_name = twin.robot().model().driven_joint_names().front();
      request.effort = 1e200;
      request.duration = to_duration_msg(from_seconds(1));
      edge.call("/gazebo/apply_joint_effort", to_cdr(request), [](const Status&, const Bytes&) {});
    }
    if (twin.diverged())
      edge.call("/gazebo/reset_simulation", to_cdr(std_srvs::srv::Empty::Request{}),
                [](const Status&, const Bytes&) {});
  });
  expect_equal();
}

TEST_F(ResimulationTest, OtherDampingIsFoundAtItsFirstMessage) {
  const fs::path package = folder_ / "ws/arm";
  fs::create_directories(package.parent_path());
  fs::copy(kRobots / "lab_arm", package, fs::copy_options::recursive);
  Scenario scenario = scenario_of(package.string());
  record(scenario, 2500, [](Twin&, Edge&, std::uint64_t) {});
  fs::remove_all(package);  // the recorded files are enough
  expect_equal();
  RecordedRun run = read();
  run.hashes[1].hash ^= 1;
  const Resimulation wrong = resimulate(run, {});
  ASSERT_TRUE(wrong.wrong_after);
  EXPECT_EQ(*wrong.wrong_after, run.hashes[1].step);
  EXPECT_FALSE(wrong.equal());
  run = read();
  run.scenario.ideal = true;
  ResimulationOptions options;
  options.compare_with = &*bag_reader_;
  const Resimulation other = resimulate(run, options);
  ASSERT_TRUE(other.wrong_after);
  ASSERT_TRUE(other.first);
  EXPECT_LT(other.first->step, 100U);
}

TEST_F(ResimulationTest, CallsThatOnlyReadLeaveRunsEqual) {
  std::optional<Rosout> rosout;
  std::optional<Node> around;
  record(scenario_of("lab_arm"), 1500, [&](Twin& twin, Edge& edge, std::uint64_t step) {
    if (step == 0) {
      rosout.emplace(twin.bus());  // as of a twin with a session
      around.emplace(twin.bus(), "/doppel");
      for (const char* const name : {"/doppel/calibrate/undo", "/rviz/get_resource", "/resource_provider"})
        around->serve<std_srvs::srv::Trigger>(name, [](const auto&, const auto& respond) { respond({}); });
    }
    const auto call = [&edge](const char* service, const Bytes& request) {
      edge.call(service, request,
                [](const Status& status, const Bytes&) { EXPECT_TRUE(status) << status.why(); });
    };
    using namespace rcl_interfaces::srv;
    if (step == 200) call("/doppel/list_parameters", to_cdr(ListParameters::Request{}));
    if (step == 300)
      call("/doppel/get_parameters", to_cdr(GetParameters::Request{.names = {"use_sim_time"}}));
    if (step == 400)
      call("/doppel/describe_parameters", to_cdr(DescribeParameters::Request{.names = {"use_sim_time"}}));
    if (step == 500) call("/doppel/get_parameter_types", to_cdr(GetParameterTypes::Request{}));
    if (step == 600) {
      type_description_interfaces::srv::GetTypeDescription::Request request;
      request.type_name = "rcl_interfaces/msg/Log";
      call("/doppel/get_type_description", to_cdr(request));
    }
    if (step == 700) call("/robot_state_publisher/list_parameters", to_cdr(ListParameters::Request{}));
    for (const char* const name : {"/doppel/calibrate/undo", "/rviz/get_resource", "/resource_provider"}) {
      if (step == 800) call(name, to_cdr(std_srvs::srv::Trigger::Request{}));
    }
    if (step < 1499) return;
    around.reset();
    rosout.reset();
  });
  expect_equal();
  EXPECT_GE(inputs_, 9U);
}

// The names that `up` proposes where another twin has its names.
TEST_F(ResimulationTest, CallsInNamespaceThatOnlyReadLeaveRunsEqual) {
  Scenario scenario = scenario_of("lab_arm");
  scenario.ros.names.add("__ns:=/second");
  scenario.ros.names.add("/doppel/validate/checks:=/checks");
  std::optional<Rosout> rosout;
  std::vector<std::unique_ptr<Node>> around;
  const auto serve = [&](Twin& twin, const char* name) {
    around.push_back(std::make_unique<Node>(twin.bus(), "/doppel"));
    around.back()->serve<std_srvs::srv::Trigger>(name, [](const auto&, const auto& respond) { respond({}); });
  };
  record(scenario, 1500, [&](Twin& twin, Edge& edge, std::uint64_t step) {
    if (step == 0) {
      rosout.emplace(twin.bus());
      serve(twin, "~/snapshot");
      serve(twin, "/doppel/validate/checks");
    }
    const auto call = [&edge](const char* service, const Bytes& request) {
      edge.call(service, request,
                [](const Status& status, const Bytes&) { EXPECT_TRUE(status) << status.why(); });
    };
    if (step == 200)
      call("/second/doppel/list_parameters", to_cdr(rcl_interfaces::srv::ListParameters::Request{}));
    for (const char* const name : {"/second/doppel/snapshot", "/checks"}) {
      if (step == 300) call(name, to_cdr(std_srvs::srv::Trigger::Request{}));
    }
    if (step == 400)
      call("/second/rosbag2_recorder/is_paused", to_cdr(rosbag2_interfaces::srv::IsPaused::Request{}));
    if (step < 1499) return;
    around.clear();
    rosout.reset();
  });
  expect_equal();
  EXPECT_GE(inputs_, 4U);
}

TEST_F(ResimulationTest, EditOfRecordingStaysInItsFolder) {
  record(scenario_of("lab_arm"), 20, [](Twin&, Edge&, std::uint64_t) {});
  RecordedRun run = read();
  std::ofstream(folder_ / "own.txt") << "mine";
  for (const char* const way : {"/urdf/../../stolen.txt", "/../stolen.txt", "", "/."}) {
    doppel_msgs::msg::EditedFiles edited;
    edited.files.resize(2);
    edited.files[0].path = run.root.string() + way;
    edited.files[0].data = {'e', 'v', 'i', 'l'};
    edited.files[1].path = run.root.string() + "/urdf/../../own.txt";
    edited.files[1].removed = true;
    doppel_msgs::msg::Input& input = run.inputs.emplace_back();
    input.kind = doppel_msgs::msg::Input::EDIT;
    input.step = 0;  // the run again ends with the last hash, that of step 1
    const Bytes cdr = to_cdr(edited);
    for (const std::byte byte : cdr) input.data.push_back(static_cast<std::uint8_t>(byte));
  }
  const Resimulation result = resimulate(run, {});
  EXPECT_THAT(result.failed_inputs,
              testing::AllOf(testing::SizeIs(4), testing::Each(HasSubstr("is outside of"))));
  EXPECT_FALSE(fs::exists(folder_ / "stolen.txt"));
  EXPECT_TRUE(fs::exists(folder_ / "own.txt"));
}

// Copies the bag with another scenario, as anyone can write it.
class ForgedBagTest : public ResimulationTest {
 protected:
  void forge(const std::string& key, std::vector<std::pair<std::string, std::string>> places = {}) {
    record(scenario_of("lab_arm"), 20, [](Twin&, Edge&, std::uint64_t) {});
    const fs::path genuine = folder_ / "genuine";
    fs::rename(bag_, genuine);
    BagReader bag(genuine.string());
    BagWriterOptions options;
    options.folder = bag_;
    BagWriter copy(options);
    for (const BagPart& part : bag.contents().attachments) {
      std::vector<std::byte> data = bag.attachment(part);
      for (const char byte : part.part.name == kScenarioAttachment ? key + "\n" : "")
        data.push_back(static_cast<std::byte>(byte));
      copy.attach({part.part.name, "text/plain", data}, 0);
    }
    copy.attach({"evil", "text/plain", {std::byte{'x'}}}, 0);
    for (const BagPart& part : bag.contents().metadata) {
      if (part.part.name == kRunMetadata) copy.add_metadata(kRunMetadata, bag.metadata(part));
    }
    copy.add_metadata(kFilesOfRunMetadata, places);
    copy_from(bag, 0, UINT64_MAX, {.hidden = true}, copy);
    copy.close();
  }
};

TEST_F(ForgedBagTest, LibraryOfRecordingIsNotLoaded) {
  forge("plugins: [evil.so]", {{"evil.so", "evil"}});
  EXPECT_THAT([&] { read(); }, testing::ThrowsMessage<InputError>(AllOf(
                                   HasSubstr("does not load code"), HasSubstr("--plugin FOLDER/evil.so"))));
}

TEST_F(ForgedBagTest, FileThatLeadsOutIsRefused) {
  forge("", {{"urdf/../../evil.txt", "evil"}});
  EXPECT_THAT([&] { read(); }, testing::ThrowsMessage<InputError>(HasSubstr("leads out of its folder")));
  EXPECT_FALSE(fs::exists(folder_ / "evil.txt"));
}

TEST_F(ForgedBagTest, RealHardwareIsNotMoved) {
  forge("hardware: real");
  EXPECT_THAT([&] { read(); }, testing::ThrowsMessage<InputError>(HasSubstr("it is of real hardware")));
}

TEST_F(ResimulationTest, RecordingThatBeganLaterIsRefused) {
  Diagnostics diagnostics;
  Twin twin(scenario_of("lab_arm"), log_, diagnostics);
  run_headless(twin, {.duration = from_seconds(0.5)});
  RunRecordingOptions options;
  options.bag.folder = bag_;
  BusRecorder recorder(twin.bus(), run_recorder_options(twin, options, log_), log_);
  run_headless(twin, {.duration = from_seconds(2)});
  recorder.stop();
  EXPECT_THAT([&] { read(); }, testing::ThrowsMessage<InputError>(HasSubstr("it begins at step")));
}

}  // namespace
}  // namespace doppel
