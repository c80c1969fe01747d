#pragma once
// ros2_control's component for servos on a bus or a board. Its thread's life: configure opens the port and
// finds every servo; activate takes five equal samples, makes them the goals and turns the torque on, with
// 30 % first; each cycle reads all servos, lets every joint's guard (motion_guard.h) bound its goal, and
// writes the goals.
//
//   disconnected -> connected -> holding <-> active <-> degraded -> fault
//
// degraded: answers are missing, the joints hold. fault: they have been missing for too long, or a servo is
// too hot to go on; the component's error, after which nothing is resumed. Wherever a joint is held, its
// goal is its present position.

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/latest_copy.h"
#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/drivers/motion_guard.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/serial/byte_link.h"
#include "doppel/export.h"

namespace doppel {

class ServoGroup;      // detail/servo_group.h
struct JointReleases;  // detail/release_watch.h

enum class DriverState { disconnected, connected, holding, active, degraded, fault };
[[nodiscard]] DOPPEL_API std::string_view to_string(DriverState state);

class DOPPEL_API ServoHardware : public HardwareComponent {
 public:
  // Opens the link of a setup. Throws InputError.
  using LinkMaker = std::function<std::unique_ptr<ByteLink>(const ServoSetup&)>;

  // The link is that of open_servo_link().
  ServoHardware();
  explicit ServoHardware(LinkMaker open);
  ~ServoHardware() override;

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
  Status relax() override;
  Status release_joint(const JointRelease& release) override;
  Status confirm_pose(std::span<const std::pair<std::string, double>> positions) override;
  void attend() override;
  [[nodiscard]] bool report(DeviceReport& out) override;
  [[nodiscard]] std::string fault() const override;
  [[nodiscard]] std::string awaits() const override;

  [[nodiscard]] const ServoSetup& setup() const { return setup_; }
  [[nodiscard]] DriverState state() const { return state_.load(); }

 private:
  static constexpr std::size_t kReported = 12;  // numbers of a joint in a report
  enum class Quantity { position, velocity, effort, current, voltage, temperature, other };
  struct StateInterface {
    std::size_t joint = 0;
    Quantity quantity = Quantity::other;
  };
  // Events of the whole arm, set in the loop and logged by attend().
  enum Event : unsigned { kDegraded = 1, kRecovered = 2, kParked = 4 };

  Status connect();
  [[nodiscard]] bool await_readings();
  Status await_rest();
  Status sample_at_rest();
  [[nodiscard]] Status check_start(std::size_t joint) const;
  void begin_guards();
  void choose_gentleness();
  void take_readings();
  void note_loss();
  void hold_all();
  bool send_goals();
  [[nodiscard]] bool gives_way(std::size_t joint) const;
  void advance_torque(Duration period);
  bool watch_heat();
  void follow_park(Duration period);
  // -- servo_hardware_release.cpp
  [[nodiscard]] Status check_release(const JointRelease& release, std::size_t joint) const;
  [[nodiscard]] Time loop_time() const;
  void watch_release();
  void catch_released();
  [[nodiscard]] double followed(std::size_t joint, double command);
  void log_catch();

  void park_and_wait();
  void record_parked_pose() const;
  void fill_states(std::span<double> states) const;
  void publish_report();
  void close();
  [[nodiscard]] HardwareReturn fail(std::string_view why);

  LinkMaker open_;
  ServoSetup setup_;
  const Log* log_ = nullptr;
  std::vector<InterfaceDescription> states_, commands_;
  std::vector<StateInterface> state_sources_;
  std::unique_ptr<ByteLink> link_;
  std::unique_ptr<ServoGroup> group_;

  // In the cycle, by the joints of the setup.
  std::vector<JointGuard> guards_;
  std::vector<ServoReading> readings_;
  std::vector<ServoGoal> goals_;
  std::vector<bool> claimed_;
  std::atomic<DriverState> state_{DriverState::disconnected};
  std::atomic<bool> unconfirmed_{false};  // a person has to confirm the pose
  std::atomic<bool> gentle_{false};
  int lost_ = 0;  // cycles in a row with an answer missing
  Time whole_{};  // of the link's clock: the last cycle with all answers
  double torque_ = 0, torque_set_ = 0;
  bool stopped_ = false, parking_ = false, parked_ = false;
  std::unique_ptr<JointReleases> release_;
  std::atomic<unsigned> caught_{0};  // joint and reason of a catch that is not logged yet
  std::array<char, 160> why_{};      // of the last failure
  std::atomic<std::uint64_t> cycles_{0}, lost_answers_{0}, damaged_{0};
  std::vector<std::atomic<unsigned>> joint_events_;
  std::atomic<unsigned> events_{0};
  std::unique_ptr<LatestCopy> reported_;
};

// The port of a setup; "auto" is the only port that there is, of USB or emulated. Throws InputError as
// open_link().
[[nodiscard]] DOPPEL_API std::string port_of(const ServoSetup& setup);
[[nodiscard]] DOPPEL_API std::unique_ptr<ByteLink> open_servo_link(const ServoSetup& setup);
// Registers the drivers under their plugin names.
class HardwareRegistry;
DOPPEL_API void register_servo_hardware(HardwareRegistry& registry);

}  // namespace doppel
