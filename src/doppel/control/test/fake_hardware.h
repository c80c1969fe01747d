#pragma once
// Hardware for tests: every joint has command and state interfaces, and follows its command perfectly, with a
// first order lag, or beside it by an offset. Failures can be ordered.

#include <map>
#include <string>
#include <vector>

#include "doppel/control/hardware.h"

namespace doppel {

struct FakeHardwareOptions {
  std::string name = "FakeSystem";
  std::vector<std::string> joints;
  std::vector<std::string> commands = {kPosition};
  std::vector<std::string> states = {kPosition, kVelocity};
  std::vector<std::string> state_only_joints;                    // mimics, for instance
  std::vector<InterfaceDescription> more_commands, more_states;  // "speed_scaling/factor"; a state of the
                                                                 // same full name as a command mirrors it
  double time_constant =
      0;  // s, of a first order lag behind position or velocity commands; 0: perfect tracking
};

class FakeHardware : public SystemInterface {
 public:
  explicit FakeHardware(FakeHardwareOptions options);

  [[nodiscard]] const std::string& name() const override { return options_.name; }
  [[nodiscard]] const std::string& plugin() const override { return plugin_; }
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override { return states_; }
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override { return commands_; }
  Status activate() override;
  Status deactivate() override;
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  void read(Time now, Duration period, std::span<double> states) override;
  void write(Time now, Duration period, std::span<const double> commands) override;

  // -- what tests set and see
  void set_position(const std::string& joint, double position);
  void set_velocity(const std::string& joint, double velocity);
  void set_offset(const std::string& joint, double offset);   // added to the position that is read
  void block(const std::string& joint, bool blocked = true);  // a blocked joint does not move
  [[nodiscard]] double position(const std::string& joint) const;
  [[nodiscard]] double velocity(const std::string& joint) const;
  [[nodiscard]] double last_command(const std::string& full_name) const;  // as write() got it
  [[nodiscard]] bool claimed(const std::string& full_name) const;

  std::string refuse_switch;  // not empty: prepare_switch refuses with it
  std::string refuse_activation;
  bool active = false;
  int reads = 0, writes = 0;
  std::vector<std::string> switches;  // "+a/position", "-b/position", in the order of perform_switch

 private:
  struct Joint {
    double position = 0, velocity = 0, effort = 0, acceleration = 0, offset = 0;
    bool blocked = false;
  };
  Joint& joint(const std::string& joint_name);
  [[nodiscard]] const Joint& joint(const std::string& joint_name) const;
  void follow(Joint& joint, const std::string& interface, double command, double dt) const;

  FakeHardwareOptions options_;
  std::string plugin_ = "doppel/FakeSystem";
  std::vector<InterfaceDescription> states_, commands_;
  std::vector<std::size_t> state_joint_, command_joint_;  // index into joints_, or npos
  std::vector<std::string> names_;
  std::vector<Joint> joints_;
  std::vector<double> last_, extra_;  // commands as written; values of states without a joint
  std::vector<bool> claimed_;
};

}  // namespace doppel
