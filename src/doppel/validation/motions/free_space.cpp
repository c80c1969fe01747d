#include "doppel/validation/motions/detail/free_space.h"

#include <algorithm>

#include "doppel/robot/collision/lowest_point.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

// The shapes and the pairs that collide in the twin: meshes are hulls there, and pairs that overlap at the
// start are excluded.
std::shared_ptr<const CollisionScene> scene_of(const Subject& subject) {
  SceneInstance robot = described_robot(subject.description(), *subject.model);
  robot.model = subject.model;
  SceneOptions options;
  const CompiledWorld& world = subject.compiled->engine->world();
  const int twin = world.find(subject.robot().name());
  for (const ExcludedPair& pair : world.excluded_pairs()) {
    if (pair.a.instance != twin || pair.b.instance != twin) continue;
    const int a = subject.model->find_link(world.name_of(pair.a));
    const int b = subject.model->find_link(world.name_of(pair.b));
    if (a >= 0 && b >= 0) options.allowed.push_back({{0, std::min(a, b)}, {0, std::max(a, b)}, pair.reason});
  }
  return std::make_shared<const CollisionScene>(std::vector{std::move(robot)}, std::move(options));
}

}  // namespace

FreeSpace::FreeSpace(const Subject& subject)
    : subject_(subject), context_(scene_of(subject)), data_(*subject.model) {
  floor_ = std::min(0.0, lowest(start_configuration(subject)));
}

double FreeSpace::lowest(const Eigen::VectorXd& q) {
  forward_kinematics(*subject_.model, data_, q);
  const SceneInstance& robot = context_.scene().instances().front();
  const Pose& X_WR = subject_.robot().instance().X_WR;
  return lowest_point(robot.shapes, [&](std::size_t link) -> Pose { return X_WR * data_.X_WL[link]; });
}

bool FreeSpace::is_free(const Eigen::VectorXd& q) {
  constexpr double kTolerance = 1e-4;  // m
  if (subject_.robot().base() == BaseKind::fixed && lowest(q) < floor_ - kTolerance) return false;
  context_.set_configuration(0, q);
  return !context_.in_collision(-kTouching);
}

bool FreeSpace::is_way_free(Eigen::VectorXd q, int joint, double target) {
  constexpr int kPlaces = 5;
  const int place = subject_.model->joints[static_cast<std::size_t>(joint)].q;
  const double start = q[place];
  for (int i = 1; i <= kPlaces; ++i) {
    q[place] = start + (target - start) * i / kPlaces;
    subject_.model->apply_mimics(q);
    if (!is_free(q)) return false;
  }
  return true;
}

}  // namespace doppel
