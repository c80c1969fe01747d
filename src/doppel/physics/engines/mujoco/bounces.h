#pragma once
// Private to the MuJoCo back end: impacts with a restitution. MuJoCo's contacts are springs and dampers,
// whose rebound depends on the step. Here the velocity along the normal that a step arrives at is that of
// Newton's law, -e times the one that it begins with, whatever the step.

#include <mujoco/mujoco.h>

#include <optional>
#include <vector>

namespace doppel {

class Bounces {
 public:
  Bounces() = default;
  // The restitution of each shape of MuJoCo's model; nullopt: it has none.
  explicit Bounces(std::vector<std::optional<double>> restitutions);

  // No shape has a restitution: these functions change nothing.
  [[nodiscard]] bool empty() const { return restitutions_.empty(); }
  // True if a contact with a restitution closes faster than it may without a rebound. Such a step has to be
  // euler's: an impact is of first order, and stages within the step would begin it more than once.
  [[nodiscard]] bool impacts(const mjModel& model, const mjData& data) const;
  // Hardens the rows of contacts with a restitution, before mj_referenceConstraint.
  void harden(const mjModel& model, mjData& data) const;
  // Writes the reference of the contacts that close, after mj_referenceConstraint. A stage that does not
  // begin the step opens them: they are met by the next step.
  void rebound(const mjModel& model, mjData& data, bool begins_step) const;

 private:
  [[nodiscard]] std::optional<double> of(const mjContact& contact) const;
  std::vector<std::optional<double>> restitutions_;  // [geoms]; empty: see empty()
};

}  // namespace doppel
