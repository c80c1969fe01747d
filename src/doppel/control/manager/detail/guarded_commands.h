#pragma once
// The position commands of all joints under a CommandGuard: a configuration that the guard does not permit is
// replaced by the last one that it did, until the commands begin near it again, so that no joint jumps to the
// end of a motion that was refused.

#include <string>
#include <vector>

#include "doppel/control/manager/command_guard.h"
#include "doppel/control/manager/detail/resource_table.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

class GuardedCommands {
 public:
  // nullptr: there is no guard, and nothing is replaced.
  explicit GuardedCommands(CommandGuard* guard) : guard_(guard) {}

  // -- between ticks
  // `command`: an index of the table's commands.
  void add(ResourceTable& table, const Model& model, std::size_t command);
  // Hardware was activated. The guard begins when its states have been read.
  void note_activation() { ticks_to_begin_ = kTicksToBegin; }
  void attend(Duration period);

  // In the loop, after the limits.
  void apply() noexcept;

 private:
  static constexpr int kTicksToBegin = 3;
  struct Entry {
    std::size_t joint = 0;
    const double* position = nullptr;
    double* applied = nullptr;
    const std::string* claimed_by = nullptr;
    double permitted = 0;  // NaN: none yet
    [[nodiscard]] bool commands() const;
  };
  [[nodiscard]] bool is_near_permitted() const;
  void hold();

  CommandGuard* guard_;
  std::vector<Entry> entries_;
  std::vector<double> positions_;  // [joints] of the model
  int ticks_to_begin_ = 0;
  bool held_ = false;
};

}  // namespace doppel
