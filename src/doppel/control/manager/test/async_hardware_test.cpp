// Hardware on its own thread: commands from before a stop, an activation or a switch of controllers are never
// written after it, although the thread writes more often than the loop.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "doppel/control/controllers/builtin.h"
#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

using testing::Each;
using testing::IsNan;
using Names = std::vector<std::string>;

constexpr const char* kReleasedGroups = R"(controller_manager:
  ros__parameters:
    left: {type: position_controllers/JointGroupPositionController}
    other: {type: position_controllers/JointGroupPositionController}
left: {ros__parameters: {joints: [a]}}
other: {ros__parameters: {joints: [a]}}
)";

// The writes and the stop of a device, which outlive it.
struct DeviceRecord {
  std::vector<double> written;
  bool stopped = false;
};

// A device whose writes can be waited for. Its thread and the test's use it.
class RecordingHardware : public FakeHardware {
 public:
  using FakeHardware::FakeHardware;
  HardwareReturn read(Time now, Duration period, std::span<double> states) override {
    std::unique_lock lock(mutex_);
    reading_ = true;
    wrote_.notify_all();
    wrote_.wait_for(lock, std::chrono::seconds(20), [this] { return !silent_; });
    reading_ = false;
    return FakeHardware::read(now, period, states);
  }
  // A bus whose servos do not answer: its thread is within read() until it speaks again.
  void fall_silent() {
    std::unique_lock lock(mutex_);
    silent_ = true;
    wrote_.wait(lock, [this] { return reading_; });
    record_->written.clear();
  }
  [[nodiscard]] std::shared_ptr<const DeviceRecord> record() const { return record_; }
  // True: it was silent until now.
  bool speak() {
    const std::lock_guard lock(mutex_);
    silent_ = false;
    wrote_.notify_all();
    return reading_;
  }
  void on_stop() override {
    const std::lock_guard lock(mutex_);
    FakeHardware::on_stop();
    record_->stopped = true;
    wrote_.notify_all();
  }
  // The commands that were written until the stop.
  std::vector<double> wait_for_stop() {
    std::unique_lock lock(mutex_);
    wrote_.wait(lock, [this] { return record_->stopped; });
    return record_->written;
  }
  HardwareReturn write(Time now, Duration period, std::span<const double> commands) override {
    const std::lock_guard lock(mutex_);
    record_->written.push_back(commands[0]);
    wrote_.notify_all();
    return FakeHardware::write(now, period, commands);
  }
  // The first commands that are written from now on.
  std::vector<double> next_writes(std::size_t count) {
    std::unique_lock lock(mutex_);
    return collect(lock, count);
  }
  // A joint moved by hand; nothing is recorded of what was written before.
  void move_by_hand(const std::string& joint, double position) {
    const std::lock_guard lock(mutex_);
    set_position(joint, position);
    record_->written.clear();
  }
  std::vector<double> writes_since_move(std::size_t count) {
    std::unique_lock lock(mutex_);
    return collect(lock, count, false);
  }
  void wait_for_write_of(double command) {
    std::unique_lock lock(mutex_);
    wrote_.wait(lock, [&] { return !record_->written.empty() && record_->written.back() == command; });
  }
  Status release_joint(const JointRelease& release) override {
    const std::lock_guard lock(mutex_);
    released = release.joint;
    return {};
  }
  std::string released;
  double present_position(const std::string& joint) {
    const std::lock_guard lock(mutex_);
    return position(joint);
  }

 private:
  std::vector<double> collect(std::unique_lock<std::mutex>& lock, std::size_t count, bool afresh = true) {
    if (afresh) record_->written.clear();
    wrote_.wait(lock, [&] { return record_->written.size() >= count; });
    return record_->written;
  }
  std::mutex mutex_;
  std::condition_variable wrote_;
  const std::shared_ptr<DeviceRecord> record_ = std::make_shared<DeviceRecord>();
  bool silent_ = false, reading_ = false;
};

// Joint a on a device that is read and written at 1000 Hz; the manager ticks only when the test says so.
struct AsyncRig {
  AsyncRig() : model(fake_robot({{"a"}})), file(ParameterFile::parse(kReleasedGroups, "test.yaml")) {
    manager = std::make_unique<ControllerManager>(bus, model, registry, &file, ControllerManagerOptions{},
                                                  log, diagnostics);
    FakeHardwareOptions options;
    options.joints = {"a"};
    options.rw_rate = 1000;
    auto made = std::make_unique<RecordingHardware>(options);
    device = made.get();
    HardwareDescription description = device->description();
    description.is_async = true;
    EXPECT_TRUE(manager->add_hardware(std::move(made), description, diagnostics));
    manager->start(Names{"left"});
    EXPECT_TRUE(load_other().ok());
  }
  Status load_other() {
    manager->load("other");
    return manager->configure("other");
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      bus.set_now(now);
      bus.spin();
      manager->tick(now);
      manager->settle(now);
      now += manager->period();
    }
  }
  void command(double position) {
    Node node(bus, "/speaker");
    node.advertise<std_msgs::msg::Float64MultiArray>("/left/commands").publish({{}, {position}}, now);
    run(2);
    device->wait_for_write_of(position);
  }
  void set_state(const std::string& label) {
    controller_manager_msgs::srv::SetHardwareComponentState::Request request;
    request.name = "FakeSystem";
    request.target_state.label = label;
    bool done = false;
    const auto edge = bus.attach("client");
    edge->call("/controller_manager/set_hardware_component_state", to_cdr(request),
               [&](Status status, Bytes) { done = status.ok(); });
    bus.spin();
    EXPECT_TRUE(done);
  }
  Bus bus;
  Model model;
  ControllerRegistry registry = builtin_controllers();
  Log log;
  Diagnostics diagnostics;
  ParameterFile file;
  RecordingHardware* device = nullptr;
  std::unique_ptr<ControllerManager> manager;
  Time now{};
};

TEST(AsyncHardware, ResetOfStopWritesNoCommandFromBefore) {
  AsyncRig rig;
  rig.command(1.0);
  rig.manager->stop("the test");
  rig.device->move_by_hand("a", 0.0);
  ASSERT_TRUE(rig.manager->reset_stop().ok());
  EXPECT_THAT(rig.device->writes_since_move(5), Each(IsNan()));
  rig.run(3);
  EXPECT_THAT(rig.device->next_writes(5), Each(IsNan()));
  EXPECT_EQ(rig.device->present_position("a"), 0.0);
}

TEST(AsyncHardware, StopDoesNotWaitForSlowBus) {
  AsyncRig rig;
  rig.command(1.0);
  rig.device->fall_silent();
  rig.manager->stop("the test");
  EXPECT_TRUE(rig.device->speak()) << "expected the stop to return within the bus's cycle";
  EXPECT_THAT(rig.device->wait_for_stop(), testing::IsEmpty()) << "expected no command after the stop";
  ASSERT_TRUE(rig.manager->reset_stop().ok());
  EXPECT_THAT(rig.device->next_writes(5), Each(IsNan()));
}

TEST(AsyncHardware, EndDuringSlowCycleStopsDevice) {
  AsyncRig rig;
  rig.command(1.0);
  const std::shared_ptr<const DeviceRecord> record = rig.device->record();
  rig.device->fall_silent();
  rig.manager->stop("the test");
  EXPECT_FALSE(record->stopped) << "expected the device to be within its cycle";
  std::thread later([&rig] {  // the end waits for the cycle
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(rig.device->speak());
  });
  rig.manager.reset();
  later.join();
  EXPECT_TRUE(record->stopped);
  EXPECT_THAT(record->written, testing::IsEmpty()) << "expected no command after the stop";
}

TEST(AsyncHardware, ActivationWritesNoCommandFromBefore) {
  AsyncRig rig;
  rig.command(1.0);
  ASSERT_TRUE(rig.manager->switch_controllers({}, Names{"left"}, Strictness::strict).ok());
  rig.set_state("inactive");
  rig.device->move_by_hand("a", 0.25);
  rig.set_state("active");
  EXPECT_THAT(rig.device->writes_since_move(5), Each(IsNan()));
  EXPECT_EQ(rig.manager->state("a/position"), 0.25) << "a state from before the activation";
  rig.run(3);
  EXPECT_THAT(rig.device->next_writes(5), Each(IsNan()));
}

TEST(AsyncHardware, ReleaseOfJointReachesActiveDeviceOnly) {
  AsyncRig rig;
  rig.command(1.0);
  EXPECT_THAT(rig.manager->release_joint({"A", 1, 0, 1, 1}).why(), testing::HasSubstr("did you mean 'a'?"));
  ASSERT_TRUE(rig.manager->release_joint({"a", 1, 0, 1, 1}).ok());
  EXPECT_EQ(rig.device->released, "a");
  rig.manager->stop("the test");
  EXPECT_THAT(rig.manager->release_joint({"a", 1, 0, 1, 1}).why(), testing::HasSubstr("emergency stop"));
  ASSERT_TRUE(rig.manager->reset_stop().ok());
  ASSERT_TRUE(rig.manager->switch_controllers({}, Names{"left"}, Strictness::strict).ok());
  rig.set_state("inactive");
  EXPECT_THAT(rig.manager->release_joint({"a", 1, 0, 1, 1}).why(), testing::HasSubstr("is inactive"));
}

TEST(AsyncHardware, RecoveredDeviceWritesNoCommandFromBefore) {
  AsyncRig rig;
  rig.command(1.0);
  rig.manager->stop("the test");  // nothing is written while the answers of the device change
  rig.device->read_answer = HardwareReturn::error;
  while (rig.manager->hardware().front().state != HardwareState::unconfigured) rig.run(1);
  rig.device->read_answer = HardwareReturn::ok;
  ASSERT_TRUE(rig.manager->reset_stop().ok());
  rig.device->move_by_hand("a", 0.25);
  rig.set_state("active");
  EXPECT_THAT(rig.device->writes_since_move(5), Each(IsNan()));
}

TEST(AsyncHardware, SwitchWritesNoCommandOfEarlierController) {
  AsyncRig rig;
  rig.command(1.0);
  ASSERT_TRUE(rig.manager->switch_controllers({}, Names{"left"}, Strictness::strict).ok());
  rig.device->move_by_hand("a", 0.0);
  ASSERT_TRUE(rig.manager->switch_controllers(Names{"other"}, {}, Strictness::strict).ok());
  EXPECT_THAT(rig.device->next_writes(5), Each(IsNan()));
  EXPECT_EQ(rig.device->present_position("a"), 0.0);
}

TEST(AsyncHardware, HandedOverJointKeepsItsCommand) {
  AsyncRig rig;
  rig.command(1.0);
  ASSERT_TRUE(rig.manager->switch_controllers(Names{"other"}, Names{"left"}, Strictness::strict).ok());
  EXPECT_THAT(rig.device->next_writes(5), Each(1.0));
}

}  // namespace
}  // namespace doppel
