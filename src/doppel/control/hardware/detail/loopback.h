#pragma once
// Hardware without a device: commands become states, after a delay, and faults can be injected. For tests of
// controllers and of the reaction to a failing device. Plugin name: doppel/Loopback.
//
// <param>s:
//   delay      s from a command to the state that it becomes; default 0: at the next read
//   unclaimed  hold (the default), free or brake: the value of when_unclaimed() (no joint moves in any case)
//   fault      late, wrong, nan, silent, error, deactivate or throw; default none
//   fault_at   the read or write, counted from 1 since on_activate, with which the fault begins; default 1
//   fault_for  how many reads or writes it lasts; default 0: for ever
//   fault_in   read (the default) or write; write: error, deactivate and throw only
//   fault_size late: s that a read takes longer, default 0.02; wrong: added to every state, default 1
//   recovers   true (the default); false: on_error refuses, and the component is finalized
//
// A position follows its command at once; where only the velocity is commanded, it is integrated. A joint's
// effort is its command. gpio and sensor states show the command of the same name.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "doppel/control/hardware/hardware.h"

namespace doppel {

class Loopback : public HardwareComponent {
 public:
  Status on_init(const HardwareInfo& info) override;
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override { return states_; }
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override { return commands_; }
  Status on_activate() override;
  Status on_deactivate() override;
  Status on_error() override;
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  [[nodiscard]] PassiveJoint when_unclaimed() const override { return unclaimed_; }
  void on_stop() override;
  void on_stop_reset() override {}
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  HardwareReturn write(Time now, Duration period, std::span<const double> commands) override;
  [[nodiscard]] std::string fault() const override;
  [[nodiscard]] bool save(SavedSlot& slot) const override;
  void restore(const SavedPart& saved) override;

 private:
  enum class Fault { none, late, wrong, nan, silent, error, deactivate, thrown };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  // Indices of the commands and states of a joint, gpio or sensor; kNone: it has none.
  struct Part {
    std::string name;
    std::array<std::size_t, 4> commands{kNone, kNone, kNone,
                                        kNone};  // position, velocity, acceleration, effort
    std::array<std::size_t, 4> states{kNone, kNone, kNone, kNone};
    std::array<double, 4> values{};  // present
  };
  void read_parameters(const HardwareInfo& info);
  void add(const HardwareJointDescription& part);
  void follow(Part& part, std::span<const double> commands, double dt);
  void halt();  // every joint stays where it is, and no delayed command moves it later
  [[nodiscard]] bool faulty(std::int64_t count) const;
  [[nodiscard]] HardwareReturn failing(std::int64_t count) const;

  // The state that changes while it runs.
  struct Saved {
    std::vector<std::array<double, 4>> values;  // [parts]
    std::vector<bool> claimed;
    std::vector<std::vector<double>> pending;
    std::size_t next = 0;
    std::int64_t reads = 0, writes = 0;
  };

  std::string name_;
  std::vector<InterfaceDescription> states_, commands_;
  std::vector<Part> parts_;
  std::vector<std::pair<std::size_t, std::size_t>> mirrors_;  // state, command: of neither of the four
  std::vector<bool> claimed_;
  std::vector<std::vector<double>> pending_;  // delayed commands, the oldest at next_
  std::size_t next_ = 0;

  PassiveJoint unclaimed_ = PassiveJoint::hold;
  Fault fault_ = Fault::none;
  bool fault_in_write_ = false, recovers_ = true;
  double delay_ = 0, fault_size_ = 0;
  std::int64_t fault_at_ = 1, fault_for_ = 0;
  std::int64_t reads_ = 0, writes_ = 0;
};

}  // namespace doppel
