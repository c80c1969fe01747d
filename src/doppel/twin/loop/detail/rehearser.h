#pragma once
// Runs a path of a robot in a copy of its engine, as fast as the physics goes, before real hardware gets it.
// The path is refused, with the joint or the pair and the time, where
//
//   - a command is beyond a joint's limits, or faster than its speed limit;
//   - a drive has no more effort and its joint falls behind, other than that of a gripper;
//   - links of the robot touch each other, a keep-out box, or another body of the world. Pairs that touch at
//     the beginning do not count, and neither does what a gripper's fingers grasp.

#include <functional>
#include <memory>
#include <span>

#include "doppel/control/manager/command_guard.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/twin/loop/detail/guard_scene.h"

namespace doppel {

class Rehearser {
 public:
  // See CollisionGuard::use_rehearsals().
  Rehearser(std::function<std::span<const double>()> present_q, bool beside_loop)
      : present_q_(std::move(present_q)), beside_loop_(beside_loop) {}

  // Between ticks: copies the engine and samples the path; the rest is done by a thread. nullptr: the path
  // is of joints that the model does not have.
  [[nodiscard]] std::unique_ptr<Rehearsal> begin(const Instance& robot,
                                                 std::shared_ptr<const GuardScene> scene,
                                                 const GuardedPath& path, Duration period) const;

 private:
  std::function<std::span<const double>()> present_q_;
  bool beside_loop_;
};

}  // namespace doppel
