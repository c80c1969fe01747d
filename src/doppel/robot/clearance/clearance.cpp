#include "doppel/robot/clearance/clearance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "doppel/robot/clearance/detail/clearance_impl.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr int kMaxLanes = 16;
constexpr double kSlabSide = 2000, kSlabDepth = 1;  // m, of the ground's surface

// m, at least, of the centre from the solid.
double solid_distance(const LaneSolid& solid, const Vector3d& p) {
  using Row = Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>;
  const Vector3d local =
      Row(solid.axes).cast<double>() * (p - Eigen::Map<const Eigen::Vector3f>(solid.centre).cast<double>());
  if (solid.kind == LaneSolidKind::half_space) return local.z() - solid.rounding;
  if (solid.kind == LaneSolidKind::cylinder) {
    const double outside = local.head<2>().norm() - solid.sizes[0],
                 above = std::abs(local.z()) - solid.sizes[2];
    return std::hypot(std::max(outside, 0.0), std::max(above, 0.0)) - solid.rounding;
  }
  const Vector3d beyond = local.cwiseAbs() - Eigen::Map<const Eigen::Vector3f>(solid.sizes).cast<double>();
  return beyond.cwiseMax(0.0).norm() - solid.rounding;
}

std::vector<Pose> poses_in_root(const SceneInstance& instance, const Eigen::VectorXd& q) {
  if (instance.model == nullptr) return {};
  Data data(*instance.model);
  forward_kinematics(*instance.model, data, q);
  return {data.X_WL.begin(), data.X_WL.end()};
}

}  // namespace

Clearance::Impl::Impl(std::shared_ptr<const CollisionScene> the_scene,
                      std::vector<std::shared_ptr<const InstanceCovers>> the_covers,
                      ClearanceOptions the_options)
    : scene(std::move(the_scene)),
      covers(std::move(the_covers)),
      options(std::move(the_options)),
      kernels(options.kernels != nullptr ? options.kernels : &lane_kernels()),
      context(scene) {
  const auto& instances = scene->instances();
  if (covers.size() != instances.size())
    throw std::invalid_argument("each instance of a scene has one cover");
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (covers[i] == nullptr || covers[i]->size() != instances[i].shapes.size())
      throw std::invalid_argument("the cover of '" + instances[i].name + "' is of another number of links");
    places.X_WR.push_back(instances[i].X_WR);
    places.q.push_back(instances[i].model ? instances[i].model->neutral() : Eigen::VectorXd());
    places.X_RL.push_back(poses_in_root(instances[i], places.q.back()));
  }
  const auto moving = static_cast<std::size_t>(options.moving);
  if (moving >= instances.size() || instances[moving].model == nullptr)
    throw std::invalid_argument("the instance that moves has no model");
  SceneInstance slab;
  slab.shapes = {{CollisionShape{Box{{kSlabSide, kSlabSide, kSlabDepth}}}}};
  slab.shapes[0][0].X_LS.translation().z() = -kSlabDepth / 2;
  CoverOptions still;
  still.still = true;
  ground = (*make_covers(slab, still))[0][0].surface;
  rebuild();
}

void Clearance::Impl::rebuild() {
  lanes = std::make_unique<const LaneScene>(*scene, covers, options, places);
  tree = lanes->tree();
  const std::size_t bytes = clearance_memory(tree);
  memory.resize(bytes + 64);
  aligned = memory.data();
  std::size_t space = memory.size();
  std::align(64, bytes, aligned, space);
  const std::size_t pairs = lanes->pairs().size();
  u.assign(static_cast<std::size_t>(kMaxLanes * variables()), 0);
  touching.assign(pairs, 0);
  rates.assign(pairs, 0);
  spans.assign(kMaxLanes, 0);
  motion.assign(pairs, 0);
  solid.assign(pairs, 0);
  X_KZ.assign(static_cast<std::size_t>(tree.joint_count), Pose::Identity());
}

std::uint32_t Clearance::Impl::run(int count, int levels, bool until_decided, bool moving) {
  LaneClearance query{};
  query.tree = &tree;
  query.u = u.data();
  query.count = count;
  query.levels = levels;
  query.rates = moving ? rates.data() : nullptr;
  query.spans = moving ? spans.data() : nullptr;
  query.paddings = lanes->paddings().empty() ? nullptr : lanes->paddings().data();
  query.until_decided = until_decided;
  query.memory = aligned;
  query.touching = touching.data();
  return count <= kLaneCount ? kernels->clearance_8(query) : kernels->clearance_16(query);
}

void Clearance::Impl::place(std::span<const double> positions, const ConstVector& q) {
  lanes->place(positions, X_KZ);
  context.set_configuration(options.moving, q);
}

double Clearance::Impl::padding(std::size_t index) const {
  return lanes->paddings().empty() ? 0 : lanes->paddings()[index];
}

bool Clearance::Impl::touches(std::size_t index) {
  if (context.surfaces_touch(pair(index).first, pair(index).second)) return true;
  // Between a robot's mesh and an object without a description the scene has hulls only, which are reduced,
  // so that the triangles could cross unseen.
  const double within = padding(index);
  const bool mixed = described(pair(index).first) != described(pair(index).second);
  return (within > 0 || mixed) && gap(index, within + kTouching, within) <= within;
}

bool Clearance::Impl::described(BodyId body) const {
  return !body.is_ground() &&
         scene->instances()[static_cast<std::size_t>(body.instance)].description != nullptr;
}

double Clearance::Impl::gap(std::size_t index, double far, double enough) const {
  const LaneScene::Body& a = lanes->bodies()[static_cast<std::size_t>(pair(index).a)];
  const LaneScene::Body& b = lanes->bodies()[static_cast<std::size_t>(pair(index).b)];
  const Pose X_KA = lanes->pose_of(pair(index).a, X_KZ), X_KB = lanes->pose_of(pair(index).b, X_KZ);
  double nearest = far;
  for (const ShapeCover& first : *a.shapes) {
    const Pose X_KF = X_KA * first.X_LG;
    if (b.shapes == nullptr) {
      nearest = std::min(
          nearest, ground->distance(*first.surface, X_KB.inverse(Eigen::Isometry) * X_KF, nearest, enough));
      continue;
    }
    const CoverSphere& around = first.cover.levels[0][0];
    for (const ShapeCover& second : *b.shapes) {
      const Pose X_FS = X_KF.inverse(Eigen::Isometry) * X_KB * second.X_LG;
      const CoverSphere& other = second.cover.levels[0][0];
      if ((X_FS * other.centre - around.centre).norm() - around.radius - other.radius >= nearest) continue;
      nearest = std::min(nearest, first.surface->distance(*second.surface, X_FS, nearest, enough));
    }
  }
  return nearest;
}

double Clearance::Impl::bound_of(std::size_t index, int level, double far) const {
  const int a = pair(index).a, b = pair(index).b;
  const auto pose = [&](int body) {
    const int joint = lanes->bodies()[static_cast<std::size_t>(body)].joint;
    return joint < 0 ? Pose::Identity() : X_KZ[static_cast<std::size_t>(joint)];
  };
  const Pose X_KA = pose(a), X_KB = pose(b);
  double nearest = far;
  const auto tighten = [&](const CoverSphere& s, const Vector3d& centre, int other_level) {
    double least = far;
    for (const LaneSolid& still : lanes->solids(b))
      least = std::min(least, solid_distance(still, centre) - s.radius);
    for (const CoverSphere& t : lanes->spheres(b, other_level))
      least = std::min(least, (centre - X_KB * t.centre).norm() - s.radius - t.radius);
    return least;
  };
  // The bounding spheres say nothing where the solids say more.
  const auto& bound_a = lanes->spheres(a, 0)[0];
  const bool solids = !lanes->solids(b).empty();
  if (tighten(bound_a, X_KA * bound_a.centre, solids ? level : 0) >= nearest) return far;
  for (const CoverSphere& s : lanes->spheres(a, level)) {
    const Vector3d centre = X_KA * s.centre;
    if (!solids && tighten(s, centre, 0) >= nearest) continue;
    nearest = std::min(nearest, tighten(s, centre, level));
  }
  return nearest;
}

Clearance::Clearance(std::shared_ptr<const CollisionScene> scene,
                     std::vector<std::shared_ptr<const InstanceCovers>> covers, ClearanceOptions options)
    : impl_(std::make_unique<Impl>(std::move(scene), std::move(covers), std::move(options))) {}
Clearance::~Clearance() = default;
Clearance::Clearance(Clearance&&) noexcept = default;

void Clearance::set_root(int instance, const Pose& X_WR) {
  impl_->context.set_root(instance, X_WR);
  impl_->places.X_WR.at(static_cast<std::size_t>(instance)) = X_WR;
  impl_->rebuild();
}

void Clearance::set_configuration(int instance, const ConstVector& q) {
  const auto i = static_cast<std::size_t>(instance);
  impl_->context.set_configuration(instance, q);
  impl_->places.q.at(i) = q;
  impl_->places.X_RL[i] = poses_in_root(impl_->scene->instances()[i], impl_->places.q[i]);
  impl_->rebuild();
}

StateClearance Clearance::state(const ConstVector& q) {
  Impl& m = *impl_;
  StateClearance out;
  m.lanes->variables_of(q, m.u.data());
  const std::span<const double> u(m.u.data(), static_cast<std::size_t>(m.variables()));
  if (!q.allFinite()) return {false, {}, {}, false};
  if (!m.lanes->in_range(u)) {
    std::ranges::fill(m.touching, 1U);
  } else if (m.run(1, kCoverLevels, false, false) == 0) {
    return out;
  }
  m.place(u, q);
  out.by_scene = true;
  for (std::size_t p = 0; p < m.touching.size(); ++p) {
    if (m.touching[p] == 0 || !m.touches(p)) continue;
    out.free = false;
    out.a = m.pair(p).first;
    out.b = m.pair(p).second;
    break;
  }
  return out;
}

void Clearance::free_states(const Eigen::Ref<const Eigen::MatrixXd>& states, std::span<bool> free) {
  Impl& m = *impl_;
  for (Eigen::Index first = 0; first < states.cols(); first += kMaxLanes) {
    const auto count = static_cast<int>(std::min<Eigen::Index>(kMaxLanes, states.cols() - first));
    std::uint32_t decided = 0, touching = 0;
    for (int lane = 0; lane < count; ++lane) {
      const std::span<double> u(m.u.data() + lane * m.variables(), static_cast<std::size_t>(m.variables()));
      m.lanes->variables_of(states.col(first + lane), u.data());
      if (!m.lanes->in_range(u) || !states.col(first + lane).allFinite()) {
        std::ranges::fill(u, 0.0);
        free[static_cast<std::size_t>(first + lane)] = is_free(states.col(first + lane));
        decided |= 1U << lane;
        // The single state has used the first lane's memory.
        if (lane > 0) m.lanes->variables_of(states.col(first), m.u.data());
      }
    }
    touching = m.run(count, kCoverLevels, false, false);
    for (int lane = 0; lane < count; ++lane) {
      if ((decided >> lane & 1U) != 0) continue;
      bool& is = free[static_cast<std::size_t>(first + lane)];
      is = (touching >> lane & 1U) == 0;
      if (is) continue;
      m.place({m.u.data() + lane * m.variables(), static_cast<std::size_t>(m.variables())},
              states.col(first + lane));
      is = true;
      for (std::size_t p = 0; p < m.touching.size() && is; ++p)
        is = (m.touching[p] >> lane & 1U) == 0 || !m.touches(p);
    }
  }
}

double Clearance::distance_bound(const ConstVector& q, int level, double far) {
  Impl& m = *impl_;
  m.lanes->variables_of(q, m.u.data());
  m.lanes->place({m.u.data(), static_cast<std::size_t>(m.variables())}, m.X_KZ);
  double nearest = far;
  for (std::size_t p = 0; p < m.touching.size(); ++p) {
    const double padding = m.padding(p);
    nearest = std::min(nearest, m.bound_of(p, level, nearest + padding) - padding);
  }
  return nearest;
}

PairDistance Clearance::distance(const ConstVector& q, double far) {
  impl_->context.set_configuration(impl_->options.moving, q);
  return impl_->context.distance(far);
}

std::uint32_t Clearance::touching_spheres(const Eigen::Ref<const Eigen::MatrixXd>& states, int level,
                                          bool until_decided) {
  Impl& m = *impl_;
  const int count = static_cast<int>(std::min<Eigen::Index>(states.cols(), kMaxLanes));
  for (int lane = 0; lane < count; ++lane)
    m.lanes->variables_of(states.col(lane), m.u.data() + lane * m.variables());
  return m.run(count, level, until_decided, false);
}

std::size_t Clearance::sphere_count(int level) const {
  return impl_->lanes->sphere_count(level);
}

std::size_t Clearance::pair_count() const {
  return impl_->lanes->pairs().size();
}

}  // namespace doppel
