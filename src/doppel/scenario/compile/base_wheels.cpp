#include "doppel/scenario/compile/detail/base_wheels.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/yaml/yaml_text.h"
#include "doppel/description/gazebo/root_link.h"
#include "doppel/physics/contract/exclusions.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

constexpr double kUpright = 0.9;           // cosine between a steering axis and the vertical
constexpr double kStraightAxle = 0.98;     // cosine between the axle of a driven wheel and y
constexpr double kSameWheelRadius = 0.05;  // relative: smaller wheels support, and are not driven
constexpr double kOnMiddleLine = 0.05;     // of the base's half width: wheels that belong to no side
constexpr double kEvenly = 0.1;            // rad, and relative: spacing of omni wheels
constexpr double kMaxSteeringRange =
    4 * std::numbers::pi;             // rad, range; a joint that turns on may be a caster
constexpr double kTrail = 0.1;        // of the radius, by which a wheel follows its swivel axis
constexpr double kRollersGrip = 0.5;  // friction across over along, of a wheel with rollers

using Wheels = std::vector<const BaseWheel*>;

Eigen::Vector3d in_plane(const Eigen::Vector3d& direction) {
  return Eigen::Vector3d(direction.x(), direction.y(), 0).normalized();
}

// The direction of the friction of a wheel with rollers, in the axes of the base.
Eigen::Vector3d grip_of(const RollingPart& part, const std::vector<Pose>& X_BL) {
  const Friction& friction = part.friction;
  if (!friction.directed() ||
      std::min(friction.along, friction.across) > kRollersGrip * std::max(friction.along, friction.across))
    return Eigen::Vector3d::Zero();
  // Gazebo's fdir1 may be given in the frame of another link, so that it does not turn with the wheel.
  const int link = friction.direction_link >= 0 ? friction.direction_link : part.link;
  const Eigen::Vector3d along = in_plane(X_BL[static_cast<std::size_t>(link)].linear() * friction.direction);
  return friction.along > friction.across ? along : Eigen::Vector3d(-along.y(), along.x(), 0);
}

// Finds what carries the wheel: the moving joints between it and the base.
void find_carrier(const Model& model, const std::vector<Pose>& X_BL, const ModelJoint& axle, int base,
                  BaseWheel& wheel) {
  for (int link = axle.parent_link; link > base;) {
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(link - 1)];
    link = joint.parent_link;
    if (joint.nv == 0 || joint.type == JointType::prismatic) continue;
    // A joint between base and wheel with a vertical axis steers the wheel, or lets it swivel like a
    // caster; one with another axis belongs to a suspension and changes neither.
    const Pose& X_BC = X_BL[static_cast<std::size_t>(joint.child_link)];
    const double up = (X_BC.linear() * joint.axis).z();
    if (std::abs(up) < kUpright) continue;  // a suspension
    // Along the rolling direction: a wheel beside its steering axis does not follow it.
    const double trail = std::abs((wheel.centre_B - X_BC.translation()).cross(wheel.axle_B).z());
    // A caster turns without end and its wheel follows behind the axis; a steered wheel has limits or
    // stands below its axis.
    const bool turns_freely = joint.upper - joint.lower > kMaxSteeringRange;
    if (joint.mimics() || (turns_freely && trail > kTrail * wheel.radius)) {
      wheel.swivels = true;
    } else {
      wheel.steering = joint.name;
      wheel.steers_right = up < 0;
      wheel.centre_B = X_BC.translation();
    }
  }
}

std::string names_of(const Wheels& wheels) {
  std::vector<std::string> names;
  for (const BaseWheel* wheel : wheels) names.push_back(wheel->joint);
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string list_of(const Wheels& wheels, std::string BaseWheel::*name = &BaseWheel::joint) {
  std::vector<std::string> quoted;
  for (const BaseWheel* wheel : wheels) quoted.push_back(yaml_text(wheel->*name));
  return fmt::format("[{}]", fmt::join(quoted, ", "));
}

template <typename Value>
double mean(const Wheels& wheels, const Value& value) {
  double sum = 0;
  for (const BaseWheel* wheel : wheels) sum += value(*wheel);
  return sum / static_cast<double>(wheels.size());
}

double mean_x(const Wheels& wheels) {
  return mean(wheels, [](const BaseWheel& w) { return w.centre_B.x(); });
}
double mean_y(const Wheels& wheels) {
  return mean(wheels, [](const BaseWheel& w) { return w.centre_B.y(); });
}
double mean_radius(const Wheels& wheels) {
  return mean(wheels, [](const BaseWheel& w) { return w.radius; });
}

struct Sides {
  Wheels left, right;
};

// Sorts wheels by the side of the base that they are on, from the middle of their own track, each from front to rear.
Sides sides_of(const Wheels& wheels) {
  Sides out;
  const auto [right, left] =
      std::ranges::minmax(wheels, {}, [](const BaseWheel* w) { return w->centre_B.y(); });
  const double middle = (left->centre_B.y() + right->centre_B.y()) / 2, half = left->centre_B.y() - middle;
  for (const BaseWheel* wheel : wheels) {
    const double y = wheel->centre_B.y() - middle;
    if (std::abs(y) <= kOnMiddleLine * half) continue;
    (y > 0 ? out.left : out.right).push_back(wheel);
  }
  for (Wheels* side : {&out.left, &out.right})
    std::ranges::stable_sort(
        *side, [](const BaseWheel* a, const BaseWheel* b) { return a->centre_B.x() > b->centre_B.x(); });
  return out;
}

// The controller for the wheels, or the reason why there is none.
struct Chosen {
  std::optional<MappedBase> base;
  std::string text;
};

class Chooser {
 public:
  Chooser(const std::vector<BaseWheel>& wheels, const RobotDescription& robot, const std::string& name)
      : robot_(robot), name_(name) {
    double largest = 0;
    for (const BaseWheel& wheel : wheels) {
      if (!wheel.swivels) largest = std::max(largest, wheel.radius);
    }
    for (const BaseWheel& wheel : wheels) {
      if (wheel.swivels || wheel.radius < (1 - kSameWheelRadius) * largest) continue;
      (wheel.steering.empty() ? fixed_ : steered_).push_back(&wheel);
    }
  }

  Chosen choose() {
    if (!steered_.empty()) return steering();
    // The order matters: the wheels of an omni base point in all directions, and two of four could pass for
    // the sides of a differential drive.
    if (is_omni()) return omni();
    Wheels straight;
    for (const BaseWheel* wheel : fixed_) {
      if (std::abs(wheel->axle_B.y()) >= kStraightAxle) straight.push_back(wheel);
    }
    if (straight.size() < 2)
      return {std::nullopt, "fewer than two of its wheels have an axle across the base"};
    const Sides sides = sides_of(straight);
    if (sides.left.empty() || sides.left.size() != sides.right.size())
      return {std::nullopt, fmt::format("it has {} wheels on the left and {} on the right", sides.left.size(),
                                        sides.right.size())};
    // A mecanum wheel is recognised by friction along its rollers at 45 degrees, which simulated models
    // have; its shape is that of any other wheel.
    if (!is_mecanum(sides)) return differential(sides);
    if (const std::string backwards = turned_backwards(straight); !backwards.empty())
      return {std::nullopt, backwards};
    return mecanum(sides);
  }

 private:
  // Axles point to the left where a positive velocity drives ahead.
  static std::string turned_backwards(const Wheels& wheels) {
    for (const BaseWheel* wheel : wheels) {
      if (wheel->axle_B.y() < 0)
        return fmt::format("a positive velocity of '{}' drives backwards (its <axis> points to the right)",
                           wheel->joint);
    }
    return "";
  }
  static bool is_mecanum(const Sides& sides) {
    const auto diagonal = [](const BaseWheel* wheel) {
      return wheel->grip_B.norm() > 0 &&
             std::abs(std::abs(wheel->grip_B.x()) - std::abs(wheel->grip_B.y())) < kEvenly;
    };
    return sides.left.size() == 2 && std::ranges::all_of(sides.left, diagonal) &&
           std::ranges::all_of(sides.right, diagonal);
  }
  [[nodiscard]] bool is_omni() const {
    if (fixed_.size() < 3) return false;
    const double x = mean_x(fixed_), y = mean_y(fixed_);
    const double radius =
        mean(fixed_, [&](const BaseWheel& w) { return std::hypot(w.centre_B.x() - x, w.centre_B.y() - y); });
    return std::ranges::all_of(fixed_, [&](const BaseWheel* w) {
      const Eigen::Vector3d out(w->centre_B.x() - x, w->centre_B.y() - y, 0);
      return std::abs(out.norm() - radius) < kEvenly * radius &&
             std::abs(in_plane(w->axle_B).dot(out.normalized())) > std::cos(kEvenly);
    });
  }

  // A controller, whose own topics are replaced by cmd_vel and odom.
  [[nodiscard]] MappedBase start(const char* type, const char* input, const char* output) const {
    MappedBase out;
    out.name = name_;
    out.type = type;
    std::vector<std::string> rules{"-r", fmt::format("{}:=cmd_vel", input), "-r",
                                   fmt::format("{}:=odom", output)};
    if (output == std::string_view("~/odometry")) rules.insert(rules.end(), {"-r", "~/tf_odometry:=/tf"});
    std::vector<std::string> quoted;
    for (const std::string& rule : rules) quoted.push_back(yaml_text(rule));
    out.declaration = fmt::format("    {}: {{type: {}, node_options_args: [{}]}}\n", out.name, type,
                                  fmt::join(quoted, ", "));
    out.section = fmt::format("{}:\n  ros__parameters:\n    base_frame_id: {}\n", out.name,
                              yaml_text(root_link_of(robot_)));
    return out;
  }
  static void set(MappedBase& out, const char* name, double value) {
    out.section += fmt::format("    {}: {:#.9g}\n", name, value);
  }
  static void add(MappedBase& out, const char* name, const std::string& yaml) {
    out.section += fmt::format("    {}: {}\n", name, yaml);
  }
  static void add_variances(MappedBase& out) {
    for (const char* name : {"pose_covariance_diagonal", "twist_covariance_diagonal"})
      add(out, name, "[0.001, 0.001, 0.001, 0.001, 0.001, 0.01]");
  }
  static void add_joints(MappedBase& out, const Wheels& wheels) {
    for (const BaseWheel* wheel : wheels) out.joints.push_back(wheel->joint);
  }

  // 1 where positive velocities of all wheels drive ahead, -1 where all drive backwards, 0 where they differ.
  static int direction_of(const Wheels& side) {
    const auto ahead =
        std::ranges::count_if(side, [](const BaseWheel* wheel) { return wheel->axle_B.y() > 0; });
    return ahead == std::ssize(side) ? 1 : ahead == 0 ? -1 : 0;
  }
  [[nodiscard]] Chosen differential(const Sides& sides) const {
    const int directions[] = {direction_of(sides.left), direction_of(sides.right)};
    for (const int side : {0, 1}) {
      if (directions[side] == 0)
        return {std::nullopt, fmt::format("positive velocities of the wheels {} drive in opposite directions",
                                          names_of(side == 0 ? sides.left : sides.right))};
    }
    MappedBase out = start("diff_drive_controller/DiffDriveController", "~/cmd_vel", "~/odom");
    const double separation = mean_y(sides.left) - mean_y(sides.right);
    Wheels all = sides.left;
    all.insert(all.end(), sides.right.begin(), sides.right.end());
    add(out, "left_wheel_names", list_of(sides.left));
    add(out, "right_wheel_names", list_of(sides.right));
    set(out, "wheel_separation", separation);
    set(out, "wheel_radius", mean_radius(all));
    std::string reversed;
    for (const int side : {0, 1}) {
      if (directions[side] > 0) continue;
      const char* name = side == 0 ? "left" : "right";
      set(out, fmt::format("{}_wheel_radius_multiplier", name).c_str(), -1.0);
      reversed += fmt::format(
          "; the axes of the {} wheels point to the right, so their radius multiplier is -1", name);
    }
    add_variances(out);
    add_joints(out, all);
    return {out,
            fmt::format("wheels {} and {}, separation {:.4g} m, radius {:.4g} m{}{}", names_of(sides.left),
                        names_of(sides.right), separation, mean_radius(all), reversed,
                        sides.left.size() > 1 ? "; these wheels scrub in turns, where the odometry is wrong "
                                                "until wheel_separation_multiplier is measured"
                                              : "")};
  }
  [[nodiscard]] Chosen mecanum(const Sides& sides) const {
    MappedBase out = start("mecanum_drive_controller/MecanumDriveController", "~/reference", "~/odometry");
    const std::pair<const char*, const BaseWheel*> wheels[] = {{"front_left", sides.left[0]},
                                                               {"front_right", sides.right[0]},
                                                               {"rear_right", sides.right[1]},
                                                               {"rear_left", sides.left[1]}};
    Wheels all;
    for (const auto& [name, wheel] : wheels) {
      add(out, fmt::format("{}_wheel_command_joint_name", name).c_str(), yaml_text(wheel->joint));
      all.push_back(wheel);
    }
    const double track = mean_y(sides.left) - mean_y(sides.right);
    const double wheelbase =
        mean_x({sides.left[0], sides.right[0]}) - mean_x({sides.left[1], sides.right[1]});
    set(out, "kinematics.wheels_radius", mean_radius(all));
    set(out, "kinematics.sum_of_robot_center_projection_on_X_Y_axis", (track + wheelbase) / 2);
    set(out, "reference_timeout", 0.5);
    add_joints(out, all);
    return {out, fmt::format("wheels {}, track {:.4g} m, wheelbase {:.4g} m, radius {:.4g} m", names_of(all),
                             track, wheelbase, mean_radius(all))};
  }
  [[nodiscard]] Chosen omni() const {
    Wheels wheels = fixed_;
    const double x = mean_x(wheels), y = mean_y(wheels);
    const auto angle = [&](const BaseWheel* w) {
      return std::atan2(w->centre_B.y() - y, w->centre_B.x() - x);
    };
    const auto outward = [&](const BaseWheel* w) {
      return Eigen::Vector3d(std::cos(angle(w)), std::sin(angle(w)), 0);
    };
    std::ranges::sort(wheels, {}, [&](const BaseWheel* w) {
      return angle(w) < -1e-6 ? angle(w) + 2 * std::numbers::pi : angle(w);
    });
    for (const BaseWheel* wheel : wheels) {
      if (wheel->axle_B.dot(outward(wheel)) < 0)
        return {
            std::nullopt,
            fmt::format("the <axis> of '{}' points inwards, and that of omni wheels outwards", wheel->joint)};
    }
    MappedBase out = start("omni_wheel_drive_controller/OmniWheelDriveController", "~/cmd_vel", "~/odom");
    const double reach =
        mean(wheels, [&](const BaseWheel& w) { return std::hypot(w.centre_B.x() - x, w.centre_B.y() - y); });
    add(out, "wheel_names", list_of(wheels));
    set(out, "wheel_offset", angle(wheels.front()));
    set(out, "robot_radius", reach);
    set(out, "wheel_radius", mean_radius(wheels));
    add_joints(out, wheels);
    return {out, fmt::format("wheels {}, {:.4g} m from the centre, radius {:.4g} m", names_of(wheels), reach,
                             mean_radius(wheels))};
  }
  // One or two fixed wheels, which drive, and one or two steered ones.
  [[nodiscard]] Chosen steering() const {
    if (fixed_.empty() || fixed_.size() > 2 || steered_.size() > fixed_.size())
      return {std::nullopt,
              fmt::format("it has {} steered and {} other wheels", steered_.size(), fixed_.size())};
    if (const std::string backwards = turned_backwards(fixed_); !backwards.empty())
      return {std::nullopt, backwards};
    for (const BaseWheel* wheel : steered_) {
      if (wheel->steers_right)
        return {std::nullopt,
                fmt::format("a positive angle of '{}' steers to the right (its <axis> points down)",
                            wheel->steering)};
    }
    const auto right_first = [](const BaseWheel* a, const BaseWheel* b) {
      return a->centre_B.y() < b->centre_B.y();
    };
    Wheels driven = fixed_, steered = steered_;
    std::ranges::sort(driven, right_first);
    std::ranges::sort(steered, right_first);
    const double wheelbase = mean_x(steered) - mean_x(driven);
    if (wheelbase <= 0) return {std::nullopt, "its steered wheels are behind the others"};
    const char* kind = driven.size() == 1 ? "bicycle" : steered.size() == 1 ? "tricycle" : "ackermann";
    const std::string type = driven.size() == 1 ? "bicycle_steering_controller/BicycleSteeringController"
                             : steered.size() == 1
                                 ? "tricycle_steering_controller/TricycleSteeringController"
                                 : "ackermann_steering_controller/AckermannSteeringController";
    MappedBase out = start(type.c_str(), "~/reference", "~/odometry");
    add(out, "traction_joints_names", list_of(driven));
    add(out, "steering_joints_names", list_of(steered, &BaseWheel::steering));
    set(out, "wheelbase", wheelbase);
    set(out, driven.size() == 1 ? "traction_wheel_radius" : "traction_wheels_radius", mean_radius(driven));
    if (driven.size() == 2)
      set(out, "traction_track_width", driven[1]->centre_B.y() - driven[0]->centre_B.y());
    if (steered.size() == 2)
      set(out, "steering_track_width", steered[1]->centre_B.y() - steered[0]->centre_B.y());
    set(out, "reference_timeout", 0.5);
    add_variances(out);
    add_joints(out, driven);
    for (const BaseWheel* wheel : steered) out.joints.push_back(wheel->steering);
    return {out, fmt::format("{}, driven {}, steered {}, wheelbase {:.4g} m, radius {:.4g} m", kind,
                             names_of(driven), list_of(steered, &BaseWheel::steering), wheelbase,
                             mean_radius(driven))};
  }

  const RobotDescription& robot_;
  const std::string& name_;
  Wheels fixed_, steered_;
};

}  // namespace

std::vector<BaseWheel> base_wheels(const ModelInstance& robot) {
  const Model& model = *robot.model;
  Data data(model);
  forward_kinematics(model, data, robot.q0);
  const int base = robot.base_link();
  const Pose X_BW = data.X_WL[static_cast<std::size_t>(base)].inverse();
  for (Pose& X : data.X_WL) X = X_BW * X;
  std::vector<BaseWheel> out;
  for (const RollingPart& part : robot.rolling) {
    if (part.kind != RollingPart::Kind::wheel) continue;
    const ModelJoint& axle = model.joints[static_cast<std::size_t>(part.joint)];
    if (axle.mimics()) continue;  // driven by its leader
    const Pose& X_BL = data.X_WL[static_cast<std::size_t>(part.link)];
    BaseWheel wheel;
    wheel.joint = axle.name;
    wheel.centre_B = X_BL * part.centre_L;
    wheel.axle_B = in_plane(X_BL.linear() * part.axis_L);
    wheel.radius = part.radius;
    wheel.grip_B = grip_of(part, data.X_WL);
    find_carrier(model, data.X_WL, axle, base, wheel);
    out.push_back(std::move(wheel));
  }
  return out;
}

std::optional<MappedBase> base_for_wheels(const std::vector<BaseWheel>& wheels, const RobotDescription& robot,
                                          const std::string& name, Diagnostics& diagnostics) {
  if (wheels.empty()) return std::nullopt;
  Chosen chosen = Chooser(wheels, robot, name).choose();
  if (chosen.base) {
    if (const std::string missing = missing_joint(robot, *chosen.base); !missing.empty())
      chosen = {std::nullopt, "its controller needs " + missing};
  }
  if (!chosen.base) {
    diagnostics.note(
        "up.base_not_generated", robot.source,
        fmt::format("the robot has wheels, but no controller for its base was generated: {}", chosen.text),
        "declare a controller of the base in a YAML file: --controllers FILE");
    return std::nullopt;
  }
  chosen.base->text = chosen.text;
  return std::move(chosen.base);
}

std::string generated_base_text(const MappedBase& base) {
  return fmt::format(
      "nothing drives the base; the controller '{}' ({}) was generated from its wheels: {}; it reads "
      "cmd_vel and publishes odom and the transform of the base",
      base.name, base.type, base.text);
}

}  // namespace doppel
