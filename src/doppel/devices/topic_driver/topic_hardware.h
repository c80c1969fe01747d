#pragma once
// ros2_control's component for an arm that a node moves: it publishes the goals of the joints, and reads
// where they are, as sensor_msgs/JointState on two topics of the bus. Its states:
//
//   disconnected -> connected -> holding <-> active <-> degraded -> fault
//
// connected: nothing is published. An activation needs five whole states in a row at one pose, inside the
// limits; they become the goals. Each cycle lets every joint's guard (motion_guard.h) bound its goal.
// degraded: states are missing, and the joints hold. fault: they have been missing for too long; the
// component's error, after which nothing is published.
//
// A message has no number, so that its stamp is what orders it: one that is not newer than that of the last
// message is dropped, and so is one that comes later than the fastest one by more than `max_delay`. Both need
// no common clock. A stamp of zero is not checked.
//
// It waits for nothing, so that it needs no thread: the bus delivers between ticks.

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/devices/drivers/motion_guard.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/devices/topic_driver/topic_setup.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {

class DOPPEL_API TopicHardware : public HardwareComponent {
 public:
  // The bus outlives it. `name_space`: "/left", of its node; empty: none.
  TopicHardware(Bus& bus, std::string name_space);

  Status on_init(const HardwareInfo& info) override;
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override { return states_; }
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override { return commands_; }
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  Status on_cleanup() override;
  Status on_shutdown() override;
  Status on_error() override;
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  [[nodiscard]] PassiveJoint when_unclaimed() const override { return PassiveJoint::hold; }
  void on_stop() override;
  void on_stop_reset() override;
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  HardwareReturn write(Time now, Duration period, std::span<const double> commands) override;
  void attend() override;
  [[nodiscard]] bool report(DeviceReport& out) override;
  [[nodiscard]] std::string fault() const override;

  [[nodiscard]] std::string awaits() const override;

  // Between ticks: why it cannot be activated; ok: it can.
  [[nodiscard]] Status readiness() const;
  [[nodiscard]] const TopicSetup& setup() const { return setup_; }
  [[nodiscard]] DriverState state() const { return state_; }

 private:
  using JointState = sensor_msgs::msg::JointState;
  struct Joint {
    explicit Joint(const TopicJoint& one);
    JointGuard guard;
    bool claimed = false;
    std::size_t command = 0;  // of command_interfaces(), where it is commanded
    // The newest state; NaN: never reported.
    double position, velocity, effort;
    double before;               // the position at the last fresh state
    Time stamp{}, seen{};        // of the message; of the loop
    bool fresh = false;          // since the last read
    bool whole = false;          // since the last whole state
    double least = 0, most = 0;  // rad or m, of the equal states so far
    unsigned events = 0;
  };
  struct StateInterface {
    std::size_t joint = 0, field = 0;  // field: position, velocity, effort
  };
  // Events of the whole arm, logged by attend().
  enum Event : unsigned {
    kDegraded = 1,
    kRecovered = 2,
    kLate = 4,
    kOutOfOrder = 8,
    kNoStamp = 16,
    kSetBack = 32
  };

  void receive(const JointState& message);
  [[nodiscard]] bool is_late(Time stamp);
  [[nodiscard]] bool is_set_back(Time stamp);
  void follow_clock(Time stamp);
  void take(Joint& joint, const JointState& message, std::size_t row);
  void take_whole(Time now);
  void count_equal(Time now);
  void forget_samples();
  [[nodiscard]] Status check_start(const TopicJoint& joint, double q) const;
  void note_silence(Time now);
  void find_echo();
  void hold_all();
  void publish_goals(Time now);
  void fill_states(std::span<double> states) const;
  [[nodiscard]] double load(std::size_t joint) const;
  [[nodiscard]] static double speed_since(const Joint& joint, Time now);
  [[nodiscard]] std::string missing_joints() const;

  Bus& bus_;
  const std::string name_space_;
  TopicSetup setup_;
  const Log* log_ = nullptr;
  std::vector<InterfaceDescription> states_, commands_;
  std::vector<StateInterface> state_sources_;
  std::unique_ptr<Node> node_;  // from on_configure() to on_cleanup()
  Publisher<JointState> topic_;
  JointState message_;
  std::vector<double> published_;  // the goals of the last message; NaN: none

  std::vector<Joint> joints_;  // of the setup
  DriverState state_ = DriverState::disconnected;
  Time now_{}, whole_{};              // of the loop; of the last whole state
  std::optional<Duration> shortest_;  // between a stamp and its arrival, of two clocks
  Time shortest_when_{};
  Time newest_stamp_{};
  // The messages in a row that are older than the newest one.
  struct Older {
    int count = 0;
    Time first{}, last{}, seen{};  // stamps; when the first one came
  } older_;
  // The whole states in a row at one pose.
  int equal_ = 0;
  Time first_equal_{};
  double interval_ = 0;  // s between states, as measured before the activation
  bool refused_ = false, stopped_ = false, warned_of_silence_ = false;
  Time configured_{};
  std::string echo_;  // the node of this program that publishes the states; empty: none
  std::uint64_t seen_graph_ = 0;
  std::uint64_t messages_ = 0, late_ = 0, disordered_ = 0, lost_ = 0;
  unsigned events_ = 0, known_events_ = 0;
};

// Registers the driver under its plugin names, in place of what they are there.
DOPPEL_API void register_topic_hardware(HardwareRegistry& registry, Bus& bus, const std::string& name_space);

}  // namespace doppel
