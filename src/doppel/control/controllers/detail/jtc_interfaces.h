#pragma once
// The claimed interfaces of a joint_trajectory_controller, sorted by kind and joint. bind() runs between
// steps, the rest in the loop.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "doppel/control/controllers/detail/jtc_settings.h"

namespace doppel::jtc {

class Interfaces {
 public:
  // Refuses if an interface that the settings need is not among the handles.
  Status bind(const Settings& settings, const std::vector<std::size_t>& joint_of_command,
              const std::vector<CommandHandle>& commands, const std::vector<StateHandle>& states);
  void release();

  // Reads the measured states; the effort is the commanded one, because it is not measured here.
  void read(JointStates& states) const;
  // Overwrites the fields of the kinds that are commanded with a number on every joint.
  void read_commands(JointStates& states) const;
  [[nodiscard]] bool all_commanded(Kind kind) const;
  // The last command of a kind on a joint; NaN: none, or the joint is not commanded.
  [[nodiscard]] double command(Kind kind, std::size_t joint) const;
  // One value for each joint; a value that is not finite is not written, so that the last
  // valid command remains.
  void write(Kind kind, std::span<const double> of_joints);

  std::optional<StateHandle> scaling_state;
  std::optional<CommandHandle> scaling_command;

 private:
  std::vector<std::size_t> joint_of_command_;
  std::vector<int> command_of_joint_;                        // -1: not commanded
  std::array<std::vector<CommandHandle>, kKinds> commands_;  // in the order of joint_of_command_
  std::array<std::vector<StateHandle>, kKinds> states_;      // [joints]
};

}  // namespace doppel::jtc
