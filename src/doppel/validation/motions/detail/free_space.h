#pragma once
// Configurations of a machine that touch neither the robot itself nor the ground.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/robot/collision/collision_scene.h"
#include "doppel/validation/checks/subject.h"

namespace doppel {

// One thread.
class FreeSpace {
 public:
  explicit FreeSpace(const Subject& subject);

  // q [nq] of Subject::model. Links that stand on the ground at the start may do so.
  [[nodiscard]] bool is_free(const Eigen::VectorXd& q);
  // The joint moves from its position in q to the target on a free way.
  [[nodiscard]] bool is_way_free(Eigen::VectorXd q, int joint, double target);

 private:
  [[nodiscard]] double lowest(const Eigen::VectorXd& q);

  const Subject& subject_;
  CollisionContext context_;
  Data data_;
  double floor_ = 0;  // m: the lowest point at the start, or the ground
};

}  // namespace doppel
