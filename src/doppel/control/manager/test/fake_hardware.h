#pragma once
// Hardware for tests: every joint has command and state interfaces, and follows its command perfectly, with a
// first-order lag, or with a constant offset. Failures can be injected.

#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/hardware/hardware.h"

namespace doppel {

struct FakeHardwareOptions {
  std::string name = "FakeSystem";
  std::vector<std::string> joints;
  std::vector<std::string> commands = {kPosition};
  std::vector<std::string> states = {kPosition, kVelocity};
  std::vector<std::string> state_only_joints;                    // mimics, for instance
  std::vector<InterfaceDescription> more_commands, more_states;  // "speed_scaling/factor"; a state of the
                                                                 // same full name as a command mirrors it
  std::optional<double> rw_rate = std::nullopt;                  // Hz; if not set, the controller manager's
  double time_constant =
      0;  // s, of a first order lag behind position or velocity commands; 0: perfect tracking
};

class FakeHardware : public HardwareComponent {
 public:
  explicit FakeHardware(FakeHardwareOptions options);

  // What its <ros2_control> element would contain.
  [[nodiscard]] HardwareDescription description() const;
  Status on_init(const HardwareInfo& info) override;
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override { return states_; }
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override { return commands_; }
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  Status on_cleanup() override;
  Status on_shutdown() override;
  Status on_error() override;
  [[nodiscard]] PassiveJoint when_unclaimed() const override { return PassiveJoint::free; }
  void on_stop() override;
  void on_stop_reset() override;
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  HardwareReturn write(Time now, Duration period, std::span<const double> commands) override;
  [[nodiscard]] std::string fault() const override { return "no reply"; }

  [[nodiscard]] bool save(SavedSlot& slot) const override;
  void restore(const SavedPart& saved) override;

  // -- what tests set and read
  void set_position(const std::string& joint, double position);
  void set_velocity(const std::string& joint, double velocity);
  void set_offset(const std::string& joint, double offset);   // added to the position that is read
  void block(const std::string& joint, bool blocked = true);  // a blocked joint does not move
  [[nodiscard]] double position(const std::string& joint) const;
  [[nodiscard]] double velocity(const std::string& joint) const;
  [[nodiscard]] double last_command(const std::string& full_name) const;  // as passed to write()
  [[nodiscard]] bool claimed(const std::string& full_name) const;
  // What write() received last before the claim on it ended; NaN: it has not ended yet.
  [[nodiscard]] double command_at_release(const std::string& full_name) const;

  std::string refuse_switch;  // not empty: prepare_switch fails with it
  std::string refuse_activation;
  bool refuse_recovery = false;  // on_error fails
  std::string throw_in;          // "on_configure", "on_stop", "read" ...: it throws "lost the port"
  // Atomic, because an asynchronous component is read and written by its own thread.
  std::atomic<HardwareReturn> read_answer = HardwareReturn::ok, write_answer = HardwareReturn::ok;
  std::vector<std::string> calls;  // of the life cycle, in order: "on_init" ...
  bool active = false;
  int reads = 0, writes = 0;
  std::vector<std::string> switches;  // "+a/position", "-b/position", in the order of perform_switch

 private:
  struct Joint {
    double position = 0, velocity = 0, effort = 0, acceleration = 0, offset = 0;
    bool blocked = false;
  };
  struct Saved {
    std::vector<Joint> joints;
    std::vector<double> last, extra, at_release;
    std::vector<bool> claimed;
  };
  Joint& joint(const std::string& joint_name);
  [[nodiscard]] const Joint& joint(const std::string& joint_name) const;
  Status called(const char* what);
  void follow(Joint& joint, const std::string& interface, double command, double dt) const;

  FakeHardwareOptions options_;
  std::vector<InterfaceDescription> states_, commands_;
  std::vector<std::size_t> state_joint_, command_joint_;  // index into joints_, or npos
  std::vector<std::string> names_;
  std::vector<Joint> joints_;
  std::vector<double> last_, extra_;  // commands as written; values of states without a joint
  std::vector<double> at_release_;
  std::vector<bool> claimed_;
};

}  // namespace doppel
