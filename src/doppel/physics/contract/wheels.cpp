#include "doppel/physics/contract/wheels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>

#include "doppel/base/core/overloaded.h"
#include "doppel/base/core/text.h"
#include "doppel/robot/collision/link_pairs.h"
#include "doppel/robot/collision/lowest_point.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

constexpr double kTwoTurns = 4.0 * std::numbers::pi;  // rad, range of a joint that is not a wheel's
constexpr double kHorizontal = 0.5;                   // largest vertical component of an axle
constexpr double kParallel = 0.999;                   // cosine between a shape's axis and the joint's
constexpr double kOffCentre = 0.02;                   // of the radius, distance of a shape from the axis
constexpr double kRoundness = 0.04;                   // of the radius; a hull of 12 sides has 3.4 %
constexpr double kProtrusion = 0.1;                   // of the radius, of other shapes of the wheel's link
constexpr double kLift = 3.0;                         // radii above the robot's lowest point, at most
constexpr int kDirections = 64;                       // in which the radius of a hull is measured
constexpr double kCasterLift = 0.2;                   // of a wheel's radius, above the wheels' lowest point
constexpr std::array<std::string_view, 3> kCasterNames{"caster", "ball", "skid"};

// A line in the frame of a link.
struct Axis {
  Eigen::Vector3d point, direction;  // direction: unit
};

// A shape that is round about an axis.
struct Round {
  double radius = 0, width = 0;                      // m
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, on the axis, in the link frame
  const char* shape = "";
  bool rolls_already = false;  // a sphere or a capsule
};

double distance_to(const Axis& axis, const Eigen::Vector3d& point) {
  return axis.direction.cross(point - axis.point).norm();
}

Eigen::Vector3d nearest_on(const Axis& axis, const Eigen::Vector3d& point) {
  return axis.point + axis.direction * axis.direction.dot(point - axis.point);
}

// Its largest distance from the axis in each of many directions is the same.
std::optional<Round> round_hull(const CollisionHull& hull, const Pose& X_LS, const Axis& axis) {
  const Eigen::Vector3d side = axis.direction.unitOrthogonal(), third = axis.direction.cross(side);
  std::array<double, kDirections> reach{};
  double low = kInfinity, high = -kInfinity, radius = 0;
  for (const Eigen::Vector3f& vertex : hull.vertices) {
    const Eigen::Vector3d p = X_LS * vertex.cast<double>() - axis.point;
    const double along = axis.direction.dot(p);
    low = std::min(low, along);
    high = std::max(high, along);
    const double x = side.dot(p), y = third.dot(p);
    radius = std::max(radius, std::hypot(x, y));
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kDirections;
      reach[static_cast<std::size_t>(i)] =
          std::max(reach[static_cast<std::size_t>(i)], x * std::cos(angle) + y * std::sin(angle));
    }
  }
  if (*std::ranges::min_element(reach) < (1.0 - kRoundness) * radius) return std::nullopt;
  return Round{radius, high - low, axis.point + axis.direction * (0.5 * (low + high)), "mesh"};
}

std::optional<Round> round_about(const CollisionShape& shape, const Axis& axis) {
  const Eigen::Vector3d centre = shape.X_LS.translation();
  const auto centred = [&](double radius) { return distance_to(axis, centre) <= kOffCentre * radius; };
  const bool parallel =
      std::abs(shape.X_LS.linear().col(2).dot(axis.direction)) >= kParallel;  // z is the shape's axis
  using Result = std::optional<Round>;
  Result out = std::visit(
      Overloaded{[&](const Cylinder& c) -> Result {
                   if (!parallel || !centred(c.radius)) return std::nullopt;
                   return Round{c.radius, c.length, nearest_on(axis, centre), "cylinder"};
                 },
                 [&](const Sphere& s) -> Result {
                   if (!centred(s.radius)) return std::nullopt;
                   return Round{s.radius, 2.0 * s.radius, nearest_on(axis, centre), "sphere", true};
                 },
                 [&](const Capsule& c) -> Result {
                   if (!parallel || !centred(c.radius)) return std::nullopt;
                   return Round{c.radius, c.length, nearest_on(axis, centre), "capsule", true};
                 },
                 [&](const SharedHull& hull) -> Result { return round_hull(*hull, shape.X_LS, axis); },
                 [](const auto&) -> Result { return std::nullopt; }},
      shape.geometry);
  if (out && out->width > 2.0 * out->radius * (1.0 + 1e-9)) out.reset();
  return out;
}

// Its largest distance from the axis, m.
double reach_about(const CollisionShape& shape, const Axis& axis) {
  Pose X_AL = Pose::Identity();  // in axes whose y is the axis
  X_AL.linear() =
      Eigen::Quaterniond::FromTwoVectors(axis.direction, Eigen::Vector3d::UnitY()).toRotationMatrix();
  X_AL.translation() = -(X_AL.linear() * axis.point);
  double lowest = kInfinity;
  for (int i = 0; i < kDirections; ++i) {
    const Pose turned(Eigen::AngleAxisd(2.0 * std::numbers::pi * i / kDirections, Eigen::Vector3d::UnitY()));
    lowest = std::min(lowest, lowest_point(shape, turned * X_AL * shape.X_LS));
  }
  return -lowest;
}

CollisionShape rolling_shape(const Round& round, const Axis& axis, const CollisionShape& from) {
  CollisionShape out = from;
  out.geometry = Ellipsoid{{round.radius, round.radius, 0.5 * round.width}};
  out.X_LS = Pose::Identity();
  out.X_LS.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis.direction).toRotationMatrix();
  out.X_LS.translation() = round.centre;
  return out;
}

// The friction of a wheel whose direction is given in the turning axes of the wheel: what is perpendicular to
// the axle means the rolling direction, and is kept as the axle, which does not turn.
void fix_turning_direction(Friction& friction, const Eigen::Vector3d& axle) {
  if (!friction.directed() || friction.direction_link >= 0) return;
  const bool rolling = std::abs(friction.direction.normalized().dot(axle)) < 0.5;
  friction.direction = axle;
  if (rolling) std::swap(friction.along, friction.across);
}

class Fitter {
 public:
  Fitter(const Model& model, const Eigen::VectorXd& q0, LinkShapes& shapes)
      : model_(model), shapes_(shapes), data_(model), groups_(rigid_groups(model)) {
    forward_kinematics(model, data_, q0);
    lowest_ = lowest_point(shapes, [this](std::size_t link) { return data_.X_WL[link]; });
  }

  std::vector<RollingPart> fit() {
    for (std::size_t i = 0; i < model_.joints.size(); ++i) {
      if (is_axle(model_.joints[i])) fit_wheel(static_cast<int>(i));
    }
    if (!found_.empty()) find_casters();
    return std::move(found_);
  }

 private:
  [[nodiscard]] bool is_axle(const ModelJoint& joint) const {
    if (!joint.scalar() || joint.type == JointType::prismatic) return false;
    if (joint.upper - joint.lower < kTwoTurns) return false;
    const Eigen::Vector3d axis = data_.X_WL[static_cast<std::size_t>(joint.child_link)].linear() * joint.axis;
    if (std::abs(axis.z()) > kHorizontal) return false;
    return std::ranges::none_of(model_.joints, [&](const ModelJoint& other) {
      return other.nv > 0 && group_of(other.parent_link) == group_of(joint.child_link);
    });
  }

  [[nodiscard]] int group_of(int link) const { return groups_[static_cast<std::size_t>(link)]; }

  void fit_wheel(int index) {
    const ModelJoint& joint = model_.joints[static_cast<std::size_t>(index)];
    const Pose& X_WJ = data_.X_WL[static_cast<std::size_t>(joint.child_link)];
    RollingPart best;
    CollisionShape* best_shape = nullptr;
    Round best_round;
    Axis best_axis{};
    for (std::size_t link = 0; link < shapes_.size(); ++link) {
      if (group_of(static_cast<int>(link)) != group_of(joint.child_link)) continue;
      const Pose X_LJ = data_.X_WL[link].inverse() * X_WJ;
      const Axis axis{X_LJ.translation(), (X_LJ.linear() * joint.axis).normalized()};
      for (CollisionShape& shape : shapes_[link]) {
        const auto round = round_about(shape, axis);
        if (!round || round->radius <= best.radius) continue;
        best = {RollingPart::Kind::wheel,
                static_cast<int>(link),
                index,
                axis.direction,
                round->centre,
                round->radius,
                round->width,
                {},
                round->shape};
        best_shape = &shape;
        best_round = *round;
        best_axis = axis;
      }
    }
    if (best_shape == nullptr || !rolls_on_ground(best, best_axis, best_shape)) return;
    fix_turning_direction(best_shape->friction, best_axis.direction);
    best.friction = best_shape->friction;
    if (!best_round.rolls_already && !best_shape->as_described)
      *best_shape = rolling_shape(best_round, best_axis, *best_shape);
    found_.push_back(std::move(best));
  }

  // A round shape at a knee does not roll: the shank reaches further from the axis, or it is high above the
  // ground.
  [[nodiscard]] bool rolls_on_ground(const RollingPart& wheel, const Axis& axis_L,
                                     const CollisionShape* shape_of_wheel) const {
    const auto own = static_cast<std::size_t>(wheel.link);
    const double bottom = (data_.X_WL[own] * wheel.centre_L).z() - wheel.radius;
    if (bottom > lowest_ + kLift * wheel.radius) return false;
    for (std::size_t link = 0; link < shapes_.size(); ++link) {
      if (group_of(static_cast<int>(link)) != group_of(wheel.link)) continue;
      const Pose X_LO = data_.X_WL[link].inverse() * data_.X_WL[own];
      const Axis axis{X_LO * axis_L.point, X_LO.linear() * axis_L.direction};
      for (const CollisionShape& shape : shapes_[link]) {
        if (&shape != shape_of_wheel && reach_about(shape, axis) > (1.0 + kProtrusion) * wheel.radius)
          return false;
      }
    }
    return true;
  }

  void find_casters() {
    double ground = kInfinity, radius = kInfinity;
    for (const RollingPart& wheel : found_) {
      const double centre = (data_.X_WL[static_cast<std::size_t>(wheel.link)] * wheel.centre_L).z();
      ground = std::min(ground, centre - wheel.radius);
      radius = std::min(radius, wheel.radius);
    }
    const int base = base_group();
    for (std::size_t link = 0; link < shapes_.size(); ++link) {
      if (group_of(static_cast<int>(link)) != base) continue;
      const std::string name = lowered(model_.links[link].name);
      const bool named = std::ranges::any_of(
          kCasterNames, [&](std::string_view part) { return name.find(part) != std::string::npos; });
      for (CollisionShape& shape : shapes_[link]) {
        const auto* const ball = std::get_if<Sphere>(&shape.geometry);
        if (ball == nullptr && !named) continue;
        const double bottom = lowest_point(shape, data_.X_WL[link] * shape.X_LS);
        if (bottom > ground + kCasterLift * radius) continue;
        shape.friction.decides = true;
        if (!shape.friction.written) shape.friction.along = shape.friction.across = kCasterFriction;
        found_.push_back({RollingPart::Kind::caster, static_cast<int>(link), -1, Eigen::Vector3d::UnitY(),
                          shape.X_LS.translation(), ball == nullptr ? 0.0 : ball->radius, 0.0, shape.friction,
                          ball == nullptr ? "skid" : "sphere"});
      }
    }
  }

  [[nodiscard]] int base_group() const { return group_of(model_.joints.front().child_link); }

  const Model& model_;
  LinkShapes& shapes_;
  Data data_;
  std::vector<int> groups_;
  double lowest_ = kInfinity;  // m, z of the robot's lowest point
  std::vector<RollingPart> found_;
};

}  // namespace

std::vector<RollingPart> fit_rolling_parts(const Model& model, const Eigen::VectorXd& q0,
                                           LinkShapes& shapes) {
  const bool floats = !model.joints.empty() && model.joints.front().type == JointType::floating &&
                      model.joints.front().parent_link == 0;
  if (!floats) return {};
  return Fitter(model, q0, shapes).fit();
}

}  // namespace doppel
