// A twin that ends, is reloaded or restored, or loses a robot, while a thread works for it: no thread uses
// what is gone, every request is answered as long as its client is there, and the twin that is left runs.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "doppel/devices/frames/feetech_frame.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/moveit_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/network/bridge.h"
#include "doppel/ros/network/test/fake_network.h"
#include "doppel/session/live/session.h"
#include "doppel/twin/loop/collision_guard.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using namespace std::chrono_literals;

// A suite that judges until it is cancelled.
class EndlessSuite : public ValidationWork {
 public:
  [[nodiscard]] doppel_msgs::srv::ListChecks::Response checks() const override { return {}; }
  void check_words(const doppel_msgs::srv::Validate::Request&) const override {}
  [[nodiscard]] std::string results() const override { return ""; }
  [[nodiscard]] std::string report(const std::string&, const std::string& page) const override {
    return page;
  }
  std::string run(const ValidationRequest&, const ValidationWatcher& watcher) override {
    while (watcher.progress(0.5, "G01")) std::this_thread::sleep_for(1ms);
    return "cancelled";
  }
};

// A program that asks the servos of a bus all the time, until its end.
class BusHost {
 public:
  explicit BusHost(const std::string& port) : link_(open_link(port, 1'000'000)) {
    thread_ = std::thread([this] { talk(); });
  }
  ~BusHost() {
    ends_ = true;
    thread_.join();
  }
  [[nodiscard]] std::uint64_t answered() const { return answered_; }

 private:
  void talk() {
    FrameBytes question;
    add_feetech_frame({1, 1, {}}, question);
    std::array<std::uint8_t, 64> answer{};
    while (!ends_ && link_->write(question.bytes()))
      answered_ += link_->read(answer, link_->now() + 5ms) > 0 ? 1 : 0;
  }

  std::unique_ptr<ByteLink> link_;
  std::atomic<bool> ends_{false};
  std::atomic<std::uint64_t> answered_{0};
  std::thread thread_;
};

class EndWithWork;
struct Work {
  const char* name;
  void (EndWithWork::*begin)();
};
struct Ending {
  const char* name;
  void (EndWithWork::*act)();
};

// Two arms with cameras, 'a' and 'b'; the work is b's.
class EndWithWork : public TwinFixture, public testing::WithParamInterface<std::tuple<Work, Ending>> {
 public:
  // Half a second of work, and under a sanitizer twenty, so that it is under way at each end.
  static constexpr double kCell = 0.045;  // m

  // -- works
  void map_reach() {
    doppel_msgs::srv::GetReach::Request request;
    request.directions = 6;
    request.cell = kCell;
    ask<doppel_msgs::srv::GetReach>("/b/doppel/reach", request);
  }
  void solve_poses() {
    moveit_msgs::srv::GetPositionIK::Request request;
    request.ik_request.avoid_collisions = true;
    for (int i = 0; i < 50; ++i) {
      request.ik_request.pose_stamped.pose.position.x = 0.1 + 0.003 * i;
      request.ik_request.pose_stamped.pose.position.z = 0.15;
      ask<moveit_msgs::srv::GetPositionIK>("/b/compute_ik", request);
    }
  }
  // Each message has a refused object, whose reason the loop logs.
  void change_scene() {
    moveit_msgs::msg::CollisionObject object;
    for (int i = 0; i < 50; ++i) {
      object.id = "box" + std::to_string(i);
      object.header.frame_id = "nowhere";
      send("/b/collision_object", object);
      moveit_msgs::srv::GetStateValidity::Request request;
      ask<moveit_msgs::srv::GetStateValidity>("/b/check_state_validity", request);
    }
  }
  void validate() {
    options_.validation = [] { return std::make_shared<EndlessSuite>(); };
    open_session();
    doppel_msgs::srv::Validate::Request request;
    request.robot = "b";
    ask<doppel_msgs::srv::Validate>("/doppel/validate", request);
    ask<doppel_msgs::srv::ListChecks>("/doppel/validate/checks", {});
  }
  void audit() { open_session(); }
  void record() {
    options_.record.emplace().bag.folder = folder_ / "recording";
    open_session();
    ASSERT_NE(session_->recorder(), nullptr);
  }
  void take_snapshot() {
    BlackBoxOptions& box = options_.black_box.emplace();
    box.scratch = folder_ / "scratch";
    box.folder = folder_ / "black_box";
    open_session();
    run(0.1);
    ask<std_srvs::srv::Trigger>("/doppel/snapshot", {});
  }
  void show_cameras() {
    options_.cameras = CameraFeedOptions{};
    options_.cameras->port = 0;
    open_session();
    for (const TopicInfo& topic : twin_->bus().topics()) {
      if (topic.name.ends_with("image_raw")) edge_->subscribe(topic.id);
    }
  }
  void reload_on_save() {
    options_.reload = true;
    open_session();
    const std::filesystem::path file = folder_ / "b/urdf/desk_arm.urdf.xacro";
    std::ofstream(file, std::ios::app) << "<!-- saved again -->\n";
    wait_for_threads(300ms);  // the watcher waits until a file is quiet
  }
  void spawn() {
    gazebo_msgs::srv::SpawnEntity::Request request;
    request.name = "guest";
    request.robot_namespace = "guest";
    request.xml = "<robot name='guest'><link name='base'/></robot>";
    ask<gazebo_msgs::srv::SpawnEntity>("/spawn_entity", request);
  }
  void measure_joint() {
    bring_up_devices(HardwareUse::emulated);
    open_session();
    doppel_msgs::srv::MeasureJoint::Request request;
    request.robot = "b";
    request.joint = "elbow_flex";
    ask<doppel_msgs::srv::MeasureJoint>("/doppel/calibrate/measure", request);
  }
  void ask_servos() {
    log_.add_sink([this](const LogLine& line) {
      const std::size_t begin = line.text.find("/dev/pts/");
      if (begin != std::string::npos) port_ = line.text.substr(begin);
    });
    bring_up_devices(HardwareUse::ports);
    ASSERT_NE(port_, "") << "expected the bus of b behind a port";
    host_.emplace(port_);
    EXPECT_TRUE(run_until([this] { return host_->answered() > 0; })) << "expected a servo to answer";
  }
  // A path that stays where the robot is: its rehearsal takes minutes where nothing ends it.
  void rehearse_path() {
    const Instance robot = twin_->find_robot("b")->instance();
    present_q_.assign(robot.q().begin(), robot.q().end());
    CollisionGuard guard(robot, {}, log_);
    guard.use_rehearsals([this] { return std::span<const double>(present_q_); }, true);
    const std::vector<std::string> joints{"wrist_roll"};
    const auto stay = [](Duration, std::span<double> positions) {
      positions[0] = 0;
      return true;
    };
    rehearsal_ = guard.rehearse({joints, from_seconds(36'000), stay}, 10ms);
    ASSERT_NE(rehearsal_, nullptr);
  }
  void call_over_network() {
    bridge_.emplace(twin_->bus(), ros2::BridgeOptions{}, log_,
                    [this](const auto&, auto on_activity) { return network_.join(std::move(on_activity)); });
    peer_ = network_.join([] {});
    client_.emplace(*peer_, ros2::ServiceSpec{.name = "/b/doppel/reach",
                                              .type = "doppel_msgs/srv/GetReach",
                                              .request_hash = "",
                                              .response_hash = ""});
    ASSERT_TRUE(run_until([this] { return client_->is_available(); })) << "expected the twin on the network";
    doppel_msgs::srv::GetReach::Request request;
    request.directions = 6;
    request.cell = kCell;
    client_->send(to_cdr(request));
    EXPECT_TRUE(run_until([this] { return bridge_->status().requests == 1; }));
  }
  void all() {
    options_.validation = [] { return std::make_shared<EndlessSuite>(); };
    show_cameras();
    map_reach();
    solve_poses();
    change_scene();
    spawn();
    doppel_msgs::srv::Validate::Request request;
    request.robot = "b";
    ask<doppel_msgs::srv::Validate>("/doppel/validate", request);
  }

  // -- endings
  void end_twin() {
    if (session_) session_->end();
    session_.reset();
    bridge_.reset();
    edge_.reset();
    twin_.reset();
  }
  void reload() {
    Diagnostics found;
    static_cast<void>(twin_->replace(Twin::prepare(twin_->running(), found)));
  }
  void delete_robot() {
    EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: b}"),
                testing::HasSubstr("success: true"));
  }
  void restore() {
    if (saved_ == nullptr) {
      EXPECT_THROW(static_cast<void>(twin_->save()), InputError) << "devices are no part of a state";
      return;
    }
    const Status restored = twin_->restore(*saved_);
    EXPECT_TRUE(restored) << restored.why();
  }

 protected:
  void SetUp() override {
    folder_ = make_folder("end_with_work");
    for (const char* name : {"a", "b"})  // each alone in its package's neighbourhood
      std::filesystem::copy(DOPPEL_SOURCE_DIR "/robots/desk_arm", folder_ / name,
                            std::filesystem::copy_options::recursive);
    options_.reload = false;
    bring_up(twin_scenario());
    run(0.02);
    saved_ = twin_->save();
    ASSERT_NE(saved_, nullptr);
  }
  void TearDown() override {
    end_twin();
    host_.reset();
    if (rehearsal_) {
      EXPECT_FALSE(rehearsal_->outcome()) << "expected the rehearsal to be under way";
    }
    rehearsal_.reset();
    std::filesystem::remove_all(folder_);
  }

  [[nodiscard]] Scenario twin_scenario() const {
    Scenario out;
    for (const char* name : {"a", "b"}) {
      WorldRobot& robot = out.robots.emplace_back();
      robot.target = (folder_ / name).string();
      robot.name_space = name;
      robot.X_WR = Pose(Eigen::Translation3d(0, name[0] == 'a' ? -0.5 : 0.5, 0));
    }
    return out;
  }
  // The same arms as devices with emulated servos.
  void bring_up_devices(HardwareUse use) {
    Scenario scenario = twin_scenario();
    scenario.hardware = use;
    for (WorldRobot& robot : scenario.robots) robot.arguments = {{"use_sim", "false"}};
    bring_up(scenario);
    run(0.02);
    saved_ = nullptr;  // devices are no part of a saved state
  }
  void open_session() {
    session_.emplace(*twin_, options_, log_);
    session_->begin();
    run(0.02);
  }
  template <class S>
  void ask(const std::string& service, const typename S::Request& request) {
    const auto answered = std::make_shared<std::atomic<bool>>(false);
    answers_.push_back(answered);
    edge_->call(service, to_cdr(request), [answered](const Status&, const Bytes&) { *answered = true; });
    twin_->between_steps();
  }
  template <class M>
  void send(const std::string& topic, const M& message) {
    const Status sent = edge_->publish("/test", topic, M::kType, to_cdr(message));
    ASSERT_TRUE(sent) << sent.why();
    twin_->between_steps();
  }
  // So that the threads have taken what was given to them.
  static void wait_for_threads(std::chrono::milliseconds time) { std::this_thread::sleep_for(time); }

  [[nodiscard]] bool all_answered() const {
    return std::ranges::all_of(answers_, [](const auto& one) { return one->load(); });
  }
  // Steps the twin.
  template <class Condition>
  bool run_until(const Condition& condition) {
    const auto end = std::chrono::steady_clock::now() + 120s;
    while (!condition() && std::chrono::steady_clock::now() < end) {
      run(0.002);
      std::this_thread::sleep_for(1ms);
    }
    return condition();
  }

  std::filesystem::path folder_;
  SessionOptions options_;
  std::optional<TwinSession> session_;
  std::shared_ptr<const SavedState> saved_;
  std::vector<std::shared_ptr<std::atomic<bool>>> answers_;
  std::string port_;
  std::optional<BusHost> host_;
  std::vector<double> present_q_;
  std::unique_ptr<Rehearsal> rehearsal_;
  ros2::test::FakeNetwork network_;
  std::optional<ros2::Bridge> bridge_;
  std::unique_ptr<ros2::Participant> peer_;
  std::optional<ros2::ServiceClient> client_;
};

TEST_P(EndWithWork, NothingIsUsedThatIsGone) {
  const auto& [work, ending] = GetParam();
  (this->*work.begin)();
  if (HasFatalFailure()) return;
  wait_for_threads(20ms);
  (this->*ending.act)();
  if (twin_ == nullptr) return;
  EXPECT_TRUE(run_until([this] { return all_answered(); })) << "a request was forgotten";
  run(0.05);
}

const Work kWorks[] = {{"map_of_reach", &EndWithWork::map_reach},
                       {"inverse_kinematics", &EndWithWork::solve_poses},
                       {"planning_scene", &EndWithWork::change_scene},
                       {"validation", &EndWithWork::validate},
                       {"audit", &EndWithWork::audit},
                       {"recording", &EndWithWork::record},
                       {"snapshot", &EndWithWork::take_snapshot},
                       {"cameras", &EndWithWork::show_cameras},
                       {"reload_on_save", &EndWithWork::reload_on_save},
                       {"spawn", &EndWithWork::spawn},
                       {"calibration", &EndWithWork::measure_joint},
                       {"emulated_bus", &EndWithWork::ask_servos},
                       {"rehearsal", &EndWithWork::rehearse_path},
                       {"call_over_network", &EndWithWork::call_over_network},
                       {"everything", &EndWithWork::all}};
const Ending kEndings[] = {{"end", &EndWithWork::end_twin},
                           {"reload", &EndWithWork::reload},
                           {"deleted_robot", &EndWithWork::delete_robot},
                           {"restore", &EndWithWork::restore}};

std::string name_of_case(const testing::TestParamInfo<std::tuple<Work, Ending>>& one) {
  return std::string(std::get<0>(one.param).name) + "_" + std::get<1>(one.param).name;
}

INSTANTIATE_TEST_SUITE_P(EveryThread, EndWithWork,
                         testing::Combine(testing::ValuesIn(kWorks), testing::ValuesIn(kEndings)),
                         name_of_case);

}  // namespace
}  // namespace doppel::test
