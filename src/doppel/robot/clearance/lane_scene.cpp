#include "doppel/robot/clearance/detail/lane_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr double kFarthestTravel = 10;  // m, of a prismatic joint without limits
constexpr double kLargestAngle = 1e4;   // rad, for which the sine of the kernel holds

float rounded_up(double value) {
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

void store_pose(const Pose& X, double* out) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out[row * 3 + column] = X.linear()(row, column);
    out[9 + row] = X.translation()[row];
  }
}

Pose pose_of_numbers(const double* numbers) {
  Pose X = Pose::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) X.linear()(row, column) = numbers[row * 3 + column];
    X.translation()[row] = numbers[9 + row];
  }
  return X;
}

CoverSphere sphere_around(const std::vector<CoverSphere>& spheres) {
  Eigen::AlignedBox3d box;
  for (const CoverSphere& s : spheres) {
    box.extend(Vector3d(s.centre.array() - s.radius));
    box.extend(Vector3d(s.centre.array() + s.radius));
  }
  CoverSphere out{box.center(), 0};
  for (const CoverSphere& s : spheres)
    out.radius = std::max(out.radius, (s.centre - out.centre).norm() + s.radius);
  return out;
}

}  // namespace

LaneScene::LaneScene(const CollisionScene& scene,
                     std::span<const std::shared_ptr<const InstanceCovers>> covers,
                     const ClearanceOptions& options, const ScenePlaces& places)
    : scene_(scene), covers_(covers), places_(places), moving_(options.moving) {
  const auto index = static_cast<std::size_t>(moving_);
  add_joints(*scene.instances()[index].model, places.q[index]);
  for (std::size_t i = 0; i < covers.size(); ++i) {
    for (std::size_t link = 0; link < covers[i]->size(); ++link) {
      if (!(*covers[i])[link].empty()) add_body({static_cast<int>(i), static_cast<int>(link)}, options);
    }
  }
  if (scene.has_shape({})) add_body({}, options);
  measure_reach();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    LaneBody lane{};
    const Body& body = bodies_[i];
    lane.joint = body.joint;
    lane.first_solid = static_cast<int>(lane_solids_.size());
    if (body.joint < 0) add_solids(lane, body);
    lane.solid_count = static_cast<int>(lane_solids_.size()) - lane.first_solid;
    add_spheres(lane, body);
    lane_bodies_.push_back(lane);
  }
  add_pairs(scene);
}

// Fixed joints, and those with several degrees of freedom, are constant parts of the transforms.
void LaneScene::add_joints(const Model& model, const Eigen::VectorXd& q) {
  links_.resize(model.links.size());
  std::vector<int> variable_of(static_cast<std::size_t>(model.nq), -1);
  for (const ModelJoint& joint : model.joints) {
    const Root& parent = links_[static_cast<std::size_t>(joint.parent_link)];
    Root& child = links_[static_cast<std::size_t>(joint.child_link)];
    if (!joint.scalar()) {
      child = {parent.joint, parent.X_ZB * parent_to_child(joint, q)};
      continue;
    }
    const ModelJoint& leader =
        joint.mimics() ? model.joints[static_cast<std::size_t>(joint.mimic_leader)] : joint;
    int& variable = variable_of[static_cast<std::size_t>(leader.q)];
    if (variable < 0) {
      variable = static_cast<int>(variables_.size());
      variables_.push_back(leader.q);
    }
    const Eigen::Matrix3d R_JZ = rotation_from_z(joint.axis);
    Pose X_PZ = parent.X_ZB * joint.X_PJ;
    X_PZ.linear() = X_PZ.linear() * R_JZ;
    LaneTreeJoint lane{};
    store_pose(X_PZ, lane.joint.X_PZ);
    lane.joint.multiplier = joint.mimics() ? joint.mimic_multiplier : 1;
    lane.joint.offset = joint.mimics() ? joint.mimic_offset : 0;
    lane.joint.variable = variable;
    lane.joint.prismatic = joint.type == JointType::prismatic;
    lane.parent = parent.joint;
    child.joint = static_cast<int>(joints_.size());
    child.X_ZB.linear() = R_JZ.transpose();
    const double limit = std::max(std::abs(joint.lower), std::abs(joint.upper));
    travel_.push_back(!lane.joint.prismatic ? 0 : std::isfinite(limit) ? limit : kFarthestTravel);
    joints_.push_back(lane);
  }
}

LaneScene::Root LaneScene::root_of(int instance) const {
  const auto i = static_cast<std::size_t>(instance);
  const auto& held = scene_.instances()[i].held;
  if (instance != moving_ && held) {
    const Root holder = body_root(held->holder);
    return {holder.joint, holder.X_ZB * held->X_LO};
  }
  const Pose X_KW = places_.X_WR[static_cast<std::size_t>(moving_)].inverse(Eigen::Isometry);
  return {-1, instance == moving_ ? Pose::Identity() : Pose(X_KW * places_.X_WR[i])};
}

LaneScene::Root LaneScene::body_root(BodyId id) const {
  const auto link = static_cast<std::size_t>(id.link);
  if (id.instance == moving_) return links_[link];
  const Root root = root_of(id.instance);
  const auto& X_RL = places_.X_RL[static_cast<std::size_t>(id.instance)];
  return {root.joint, X_RL.empty() ? root.X_ZB : Pose(root.X_ZB * X_RL[link])};
}

void LaneScene::add_body(BodyId id, const ClearanceOptions& options) {
  Body body;
  body.id = id;
  if (id.is_ground()) {
    body.X_ZB = places_.X_WR[static_cast<std::size_t>(moving_)].inverse(Eigen::Isometry);
    bodies_.push_back(body);
    spheres_.emplace_back();
    return;
  }
  const Root root = body_root(id);
  body.joint = root.joint;
  body.X_ZB = root.X_ZB;
  body.shapes = &(*covers_[static_cast<std::size_t>(id.instance)])[static_cast<std::size_t>(id.link)];
  if (body.joint >= 0 || id.instance == moving_) body.padding = options.padding;
  for (const auto& [single, padding] : options.paddings) {
    if (single == id) body.padding = padding;
  }
  auto& levels = spheres_.emplace_back();
  for (const ShapeCover& shape : *body.shapes) {
    const Pose X_ZG = body.X_ZB * shape.X_LG;
    // A body that stands still is its solids where it has a formula.
    const bool solid = body.joint < 0 && shape.formula;
    for (std::size_t level = 0; level < 3; ++level) {
      if (solid && level > 0) continue;
      for (const CoverSphere& s : shape.cover.levels[level])
        levels[level].push_back({X_ZG * s.centre, s.radius});
    }
  }
  levels[0] = {sphere_around(levels[0])};
  measure(body, static_cast<int>(spheres_.size()) - 1);
  bodies_.push_back(body);
}

// The bounding sphere and the fine ones contain the body each, so that the smaller number holds.
void LaneScene::measure(Body& body, int index) {
  for (const int level : {0, 2}) {
    const auto& of_level = spheres(index, level);
    double radius = 0, reach = 0;
    for (const CoverSphere& s : of_level) {
      radius = std::max(radius, s.centre.head<2>().norm() + s.radius);
      reach = std::max(reach, s.centre.norm() + s.radius);
    }
    if (of_level.empty()) continue;
    body.radius = level == 0 ? radius : std::min(body.radius, radius);
    body.reach = level == 0 ? reach : std::min(body.reach, reach);
  }
}

void LaneScene::measure_reach() {
  for (const Body& body : bodies_) {
    if (body.joint < 0) continue;
    double reach = body.reach;
    for (int joint = body.joint; joint >= 0; joint = joints_[static_cast<std::size_t>(joint)].parent) {
      const auto i = static_cast<std::size_t>(joint);
      reach += pose_of_numbers(joints_[i].joint.X_PZ).translation().norm() + travel_[i];
    }
    extent_ = std::max(extent_, reach + body.padding);
  }
}

int LaneScene::depth_of(int joint) const {
  int depth = 0;
  for (; joint >= 0; joint = joints_[static_cast<std::size_t>(joint)].parent) ++depth;
  return depth;
}

void LaneScene::add_spheres(LaneBody& lane, const Body& body) {
  const auto& levels = spheres_[static_cast<std::size_t>(&body - bodies_.data())];
  const auto lane_sphere = [&](const CoverSphere& s) {
    // A body that stands still may be farther away than moving ones reach.
    const double farthest = std::max(extent_, body.joint < 0 ? s.centre.norm() + s.radius : 0.0);
    const double error = clearance_error(depth_of(body.joint)) * farthest;
    return LaneSphere{static_cast<float>(s.centre.x()), static_cast<float>(s.centre.y()),
                      static_cast<float>(s.centre.z()), rounded_up(s.radius + error)};
  };
  lane.bound = levels[0].empty() ? LaneSphere{0, 0, 0, -1} : lane_sphere(levels[0][0]);
  for (std::size_t level = 0; level < kCoverLevels; ++level) {
    lane.first[level] = static_cast<int>(lane_spheres_.size());
    lane.count[level] = static_cast<int>(levels[level + 1].size());
    for (const CoverSphere& s : levels[level + 1]) lane_spheres_.push_back(lane_sphere(s));
  }
}

void LaneScene::add_solid(const CollisionShape& shape, const Pose& X_KS) {
  LaneSolid out{};
  const auto set_sizes = [&](const Vector3d& sizes) {
    for (int k = 0; k < 3; ++k) out.sizes[k] = static_cast<float>(sizes[k]);
    return sizes.norm();
  };
  double size = 0, rounding = 0;
  if (const auto* box = std::get_if<Box>(&shape.geometry)) size = set_sizes(box->size / 2);
  if (const auto* sphere = std::get_if<Sphere>(&shape.geometry)) rounding = sphere->radius;
  if (const auto* capsule = std::get_if<Capsule>(&shape.geometry)) {
    size = set_sizes({0, 0, capsule->length / 2});
    rounding = capsule->radius;
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&shape.geometry)) {
    out.kind = LaneSolidKind::cylinder;
    size = set_sizes({cylinder->radius, 0, cylinder->length / 2});
  }
  for (int k = 0; k < 3; ++k) {
    out.centre[k] = static_cast<float>(X_KS.translation()[k]);
    for (int row = 0; row < 3; ++row) out.axes[row * 3 + k] = static_cast<float>(X_KS.linear()(k, row));
  }
  out.rounding = rounded_up(rounding + clearance_error(0) * (X_KS.translation().norm() + size + extent_));
  lane_solids_.push_back(out);
}

void LaneScene::add_solids(LaneBody& lane, const Body& body) {
  if (body.shapes != nullptr) {
    for (const ShapeCover& shape : *body.shapes) {
      if (shape.formula) add_solid(*shape.formula, body.X_ZB * shape.X_LG * shape.formula->X_LS);
    }
    return;
  }
  LaneSolid ground{};
  ground.kind = LaneSolidKind::half_space;
  const Vector3d up = body.X_ZB.linear().col(2);
  for (int k = 0; k < 3; ++k) {
    ground.centre[k] = static_cast<float>(body.X_ZB.translation().dot(up) * up[k]);
    ground.axes[6 + k] = static_cast<float>(up[k]);
  }
  ground.rounding = rounded_up(clearance_error(0) * (std::abs(body.X_ZB.translation().dot(up)) + extent_));
  lane_solids_.push_back(ground);
  lane.bound.radius = -1;
}

void LaneScene::add_pairs(const CollisionScene& scene) {
  const auto find = [&](BodyId id) {
    return static_cast<int>(std::ranges::find(bodies_, id, &Body::id) - bodies_.begin());
  };
  for (const auto& [first, second] : scene.tested_pairs()) {
    int a = find(first), b = find(second);
    if (bodies_[static_cast<std::size_t>(a)].joint < 0) std::swap(a, b);
    const Body &moving = bodies_[static_cast<std::size_t>(a)], &other = bodies_[static_cast<std::size_t>(b)];
    if (moving.joint < 0 || moving.joint == other.joint) continue;
    // Beyond the reach of everything that moves.
    if (other.joint < 0 && !other.id.is_ground()) {
      const CoverSphere& bound = spheres(b, 0)[0];
      if (bound.centre.norm() - bound.radius > extent_ + other.padding + 1e-6) continue;
    }
    pairs_.push_back({a, b, first, second});
  }
  std::ranges::stable_sort(pairs_, {}, [this](const Pair& pair) {
    return run_order(lane_bodies_, {pair.a, pair.b});
  });
  for (const Pair& pair : pairs_) {
    lane_pairs_.push_back({pair.a, pair.b});
    const double padding =
        bodies_[static_cast<std::size_t>(pair.a)].padding + bodies_[static_cast<std::size_t>(pair.b)].padding;
    paddings_.push_back(padding != 0 ? rounded_up(padding) : 0.0F);
  }
  if (std::ranges::all_of(paddings_, [](float padding) { return padding == 0; })) paddings_.clear();
  runs_ = lane_runs(lane_bodies_, lane_pairs_);
}

LaneTree LaneScene::tree() const {
  return {joints_.data(),
          lane_bodies_.data(),
          lane_spheres_.data(),
          lane_solids_.data(),
          lane_pairs_.data(),
          runs_.groups.data(),
          runs_.runs.data(),
          static_cast<int>(joints_.size()),
          static_cast<int>(lane_bodies_.size()),
          static_cast<int>(lane_spheres_.size()),
          static_cast<int>(lane_pairs_.size()),
          static_cast<int>(runs_.groups.size()),
          static_cast<int>(runs_.runs.size()),
          static_cast<int>(variables_.size())};
}

std::size_t LaneScene::sphere_count(int level) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    count += bodies_[i].joint >= 0 ? spheres_[i][static_cast<std::size_t>(level)].size() : 0;
  return count;
}

std::span<const LaneSolid> LaneScene::solids(int body) const {
  const LaneBody& lane = lane_bodies_[static_cast<std::size_t>(body)];
  return {lane_solids_.data() + lane.first_solid, static_cast<std::size_t>(lane.solid_count)};
}

void LaneScene::variables_of(const ConstVector& q, double* u) const {
  for (std::size_t v = 0; v < variables_.size(); ++v) u[v] = q[variables_[v]];
}

bool LaneScene::in_range(std::span<const double> u) const {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const LaneJoint& joint = joints_[i].joint;
    const double position = joint.multiplier * u[static_cast<std::size_t>(joint.variable)] + joint.offset;
    const double most = joint.prismatic ? travel_[i] + 1e-9 : kLargestAngle;
    if (!(std::abs(position) <= most)) return false;
  }
  return true;
}

void LaneScene::place(std::span<const double> u, std::vector<Pose>& X_KZ) const {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const LaneJoint& joint = joints_[i].joint;
    const double position = joint.multiplier * u[static_cast<std::size_t>(joint.variable)] + joint.offset;
    Pose X = pose_of_numbers(joint.X_PZ);
    if (joints_[i].parent >= 0) X = X_KZ[static_cast<std::size_t>(joints_[i].parent)] * X;
    if (joint.prismatic) {
      X.translation() += X.linear().col(2) * position;
    } else {
      X.linear() = X.linear() * Eigen::AngleAxisd(position, Vector3d::UnitZ()).toRotationMatrix();
    }
    X_KZ[i] = X;
  }
}

Pose LaneScene::pose_of(int body, const std::vector<Pose>& X_KZ) const {
  const Body& placed = bodies_[static_cast<std::size_t>(body)];
  return placed.joint < 0 ? placed.X_ZB : X_KZ[static_cast<std::size_t>(placed.joint)] * placed.X_ZB;
}

void LaneScene::motion(std::span<const double> u0, std::span<const double> u1,
                       std::vector<double>& per_pair) const {
  // Joints between the body and `end`, the last one that both bodies of a pair hang on.
  const auto moved = [&](const Body& body, int end) {
    // Numbers of the joint at hand: the farthest point of the body from its axis, and from the origin of its
    // Z.
    double sum = 0, radius = body.radius, reach = body.reach;
    for (int k = body.joint; k != end; k = joints_[static_cast<std::size_t>(k)].parent) {
      const auto i = static_cast<std::size_t>(k);
      const LaneJoint& joint = joints_[i].joint;
      const auto v = static_cast<std::size_t>(joint.variable);
      sum += std::abs(joint.multiplier * (u1[v] - u0[v])) * (joint.prismatic ? 1.0 : radius);
      if (joint.prismatic)
        reach += std::max(std::abs(joint.multiplier * u0[v] + joint.offset),
                          std::abs(joint.multiplier * u1[v] + joint.offset));
      const Vector3d p(joint.X_PZ[9], joint.X_PZ[10], joint.X_PZ[11]);
      radius = p.head<2>().norm() + reach;
      reach += p.norm();
    }
    return sum;
  };
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const Body& a = bodies_[static_cast<std::size_t>(pairs_[p].a)];
    const Body& b = bodies_[static_cast<std::size_t>(pairs_[p].b)];
    int i = a.joint, k = b.joint;
    while (i != k) {
      // Parents have smaller indices.
      int& deeper = i > k ? i : k;
      deeper = joints_[static_cast<std::size_t>(deeper)].parent;
    }
    per_pair[p] = moved(a, i) + moved(b, k);
  }
}

}  // namespace doppel
