#pragma once
// Refuses motions of a robot that end in a contact of its own links, or inside a keep-out box: the twin's
// geometry in front of real hardware (guard_scene.h). On request paths also run in the physics first.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/control/manager/command_guard.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/physics/contract/keep_out.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {

class GuardScene;  // detail/guard_scene.h
class Rehearser;   // detail/rehearser.h

class DOPPEL_API CollisionGuard : public CommandGuard {
 public:
  // `log` outlives the guard.
  CollisionGuard(const Instance& robot, std::vector<KeepOutBox> boxes, const Log& log);
  ~CollisionGuard() override;
  CollisionGuard(const CollisionGuard&) = delete;
  CollisionGuard& operator=(const CollisionGuard&) = delete;

  // -- at the start
  // Paths are rehearsed in copies of the robot's engine (rehearser.h). `present_q`: [nq] of the robot.
  // beside_loop: by a thread; else at once, so that a run in simulated time is repeatable.
  void use_rehearsals(std::function<std::span<const double>()> present_q, bool beside_loop);
  // Only rehearsals refuse.
  void permit_all() { refuses_ = false; }

  // Between ticks: another model with the same joints.
  void take_over(const Instance& robot);
  // Between ticks: the same instance under another handle.
  void rebind(Instance robot) { robot_ = robot; }

  [[nodiscard]] Status check(const GuardedPath& path) override;
  [[nodiscard]] std::unique_ptr<Rehearsal> rehearse(const GuardedPath& path, Duration period) override;
  // permits() may take a fifth of the period; where it takes more, it permits everything, and a warning
  // says so.
  void begin(std::span<const double> positions, Duration period) override;
  void attend() override;
  [[nodiscard]] bool permits(std::span<const double> positions) noexcept override;

  // s, of permits(), as begin() measured it.
  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] std::size_t pair_count() const { return pairs_.size(); }

 private:
  void leave_out_touching();
  void take(std::span<const double> positions);
  // An index of the scene's tested pairs.
  [[nodiscard]] std::optional<std::size_t> touching(double clearance);
  [[nodiscard]] double measured_cost();

  const std::vector<KeepOutBox> boxes_;
  const Log& log_;
  Instance robot_;
  std::shared_ptr<const Model> model_;
  std::shared_ptr<const GuardScene> scene_;
  std::unique_ptr<CollisionContext> context_;
  std::unique_ptr<Rehearser> rehearser_;  // nullptr: paths are not rehearsed
  bool refuses_ = true;
  std::vector<std::size_t> pairs_;  // without those that touched at the beginning
  Eigen::VectorXd q_;               // [nq]
  double cost_ = 0;
  bool too_slow_ = false;
  std::optional<std::size_t> refused_;  // pair of the present episode
  bool reported_ = false;
  std::uint64_t episodes_ = 0;
};

}  // namespace doppel
