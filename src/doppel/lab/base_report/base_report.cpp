#include "doppel/lab/base_report/base_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "doppel/lab/base_report/detail/base_drive.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSpeed = 0.4, kTurnSpeed = 0.8;  // m/s, rad/s; the controller's limits apply
constexpr double kStraight = 5, kTurn = 10, kSide = 4;
constexpr double kSettle = 1.0;        // s, until the base stands
constexpr double kRunUp = 1.0;         // s, after which casters have swung round
constexpr double kStartTimeout = 3.0;  // s, in which a base that can move has moved
constexpr double kMoved = 0.005;       // m or rad
constexpr double kMaxMotion = 300;     // s of a motion
constexpr double kCheck = 0.1;         // s, between two looks
constexpr double kArcRadius = 1.5;     // m, of a base that cannot turn on the spot
constexpr int kFitPasses = 20;

double distance(const PlanarPose& pose) {
  return std::hypot(pose.x, pose.y);
}

class Survey {
 public:
  Survey(BaseDrive& base, bool turns_on_spot) : base_(base), turns_on_spot_(turns_on_spot) {}

  BaseLeg straight() {
    run_up(kSpeed, 0);
    base_.begin_leg();
    drive_until(kSpeed, 0, [this] { return distance(base_.truth()) > kStraight; });
    return finished(BaseLeg::Kind::straight, true);
  }
  BaseLeg turn(double direction) {
    run_up(corner_speed(), direction * corner_rate());
    base_.begin_leg();
    drive_until(corner_speed(), direction * corner_rate(),
                [this] { return std::abs(base_.truth().heading) > kTurn; });
    return finished(BaseLeg::Kind::turn, direction > 0);
  }
  // Steered by the odometry alone.
  BaseLeg square(double direction) {
    run_up(kSpeed, 0);
    base_.begin_leg();
    for (int side = 0; side < 4; ++side) {
      const PlanarPose corner = base_.odometry();
      drive_until(kSpeed, 0, [&] {
        const PlanarPose now = base_.odometry();
        return std::hypot(now.x - corner.x, now.y - corner.y) > kSide - kSpeed * kSpeed;
      });
      base_.stop();
      drive_until(corner_speed(), direction * corner_rate(), [&] {
        return std::abs(base_.odometry().heading) > (side + 1) * kPi / 2 - corner_rate() * kCheck;
      });
      base_.stop();
    }
    return finished(BaseLeg::Kind::square, direction > 0);
  }

 private:
  [[nodiscard]] double corner_speed() const { return turns_on_spot_ ? 0.0 : kSpeed; }
  [[nodiscard]] double corner_rate() const { return turns_on_spot_ ? kTurnSpeed : kSpeed / kArcRadius; }
  void run_up(double v, double w) {
    base_.drive(kRunUp, v, w);
    base_.stop();
  }
  BaseLeg finished(BaseLeg::Kind kind, bool left) {
    base_.stop();
    BaseLeg out = base_.end_leg();
    out.kind = kind;
    out.left = left;
    return out;
  }
  template <class Done>
  void drive_until(double v, double w, const Done& done) {
    const PlanarPose start = base_.truth();
    for (int looks = 0; !done() && !base_.diverged(); ++looks) {
      const double t = kCheck * looks;
      base_.drive(kCheck, v, w);
      const PlanarPose now = base_.truth();
      const double moved =
          std::hypot(now.x - start.x, now.y - start.y) + std::abs(now.heading - start.heading);
      if ((t > kStartTimeout && moved < kMoved) || t > kMaxMotion) refuse(v, w, t);
    }
  }
  [[noreturn]] void refuse(double v, double w, double seconds) const {
    throw InputError(
        "base.does_not_move", {},
        fmt::format("the base did not finish the leg: commanded {} m/s and {} rad/s on {} for {:.0f} s", v, w,
                    base_.topics().command, seconds),
        "`doppel up` shows whether it stands on its wheels, and what its controller reports");
  }

  BaseDrive& base_;
  bool turns_on_spot_;
};

// The wheels and numbers of a differential base's controller.
struct Differential {
  std::vector<std::string> left, right;
  double separation = 0, radius = 0;
  BaseMultipliers multipliers;
};

double number(ParameterOverrides& of, const char* name, double otherwise) {
  const ParameterOverride* const found = of.find(name);
  if (found == nullptr) return otherwise;
  if (const auto* value = std::get_if<double>(&found->value)) return *value;
  if (const auto* value = std::get_if<std::int64_t>(&found->value)) return static_cast<double>(*value);
  return otherwise;
}

std::vector<std::string> names(ParameterOverrides& of, const char* name) {
  const ParameterOverride* const found = of.find(name);
  const auto* const value = found == nullptr ? nullptr : std::get_if<std::vector<std::string>>(&found->value);
  return value == nullptr ? std::vector<std::string>{} : *value;
}

std::optional<Differential> differential(const TwinRobot& robot, const BaseTopics& topics) {
  if (topics.type != "diff_drive_controller/DiffDriveController") return std::nullopt;
  ParameterOverrides of = robot.machine().setup().controllers.overrides_for(
      in_namespace(robot.name_space(), topics.controller), topics.controller);
  Differential out;
  out.left = names(of, "left_wheel_names");
  out.right = names(of, "right_wheel_names");
  out.separation = number(of, "wheel_separation", 0);
  out.radius = number(of, "wheel_radius", 0);
  out.multipliers = {number(of, "wheel_separation_multiplier", 1),
                     number(of, "left_wheel_radius_multiplier", 1),
                     number(of, "right_wheel_radius_multiplier", 1)};
  return out;
}

const BaseLeg& leg_of(const std::vector<BaseLeg>& legs, BaseLeg::Kind kind, bool left) {
  return *std::ranges::find_if(legs,
                               [&](const BaseLeg& leg) { return leg.kind == kind && leg.left == left; });
}

void summarise(BaseReport& report) {
  const BaseLeg& straight = leg_of(report.legs, BaseLeg::Kind::straight, true);
  report.slip = distance(straight.truth) / distance(straight.odometry) - 1;
  report.drift = straight.truth.y;
  report.drift_heading = straight.truth.heading;
  if (!report.present) return;
  report.fitted = fit_multipliers(report.legs, report.wheel_separation);
  for (const bool left : {true, false}) {
    const BaseLeg& square = leg_of(report.legs, BaseLeg::Kind::square, left);
    const PlanarPose end = integrate_odometry(square.rolled, report.wheel_separation, *report.fitted);
    report.square_error_fitted[left ? 0 : 1] = std::hypot(end.x - square.truth.x, end.y - square.truth.y);
  }
}

bool can_turn_on_spot(const std::string& type) {
  return type.find("_steering_controller") == std::string::npos && !type.starts_with("tricycle_controller");
}

}  // namespace

double BaseLeg::odometry_error() const {
  return std::hypot(odometry.x - truth.x, odometry.y - truth.y);
}

PlanarPose integrate_odometry(const std::vector<std::array<double, 2>>& rolled, double wheel_separation,
                              const BaseMultipliers& with) {
  PlanarPose out;
  std::array<double, 2> before = {0, 0};
  for (const auto& now : rolled) {
    const double left = with.left_radius * (now[0] - before[0]);
    const double right = with.right_radius * (now[1] - before[1]);
    const double turn = (right - left) / (wheel_separation * with.separation);
    const double chord = (left + right) / 2 * (std::abs(turn) < 1e-9 ? 1 : std::sin(turn / 2) / (turn / 2));
    out.x += chord * std::cos(out.heading + turn / 2);
    out.y += chord * std::sin(out.heading + turn / 2);
    out.heading += turn;
    before = now;
  }
  return out;
}

// The straight gives the radii for a track, and the turns give the track for radii; each improves the other by
// the ratio of the straight's small angle, so that a few passes converge.
BaseMultipliers fit_multipliers(const std::vector<BaseLeg>& legs, double wheel_separation) {
  const BaseLeg& straight = leg_of(legs, BaseLeg::Kind::straight, true);
  const double half = straight.truth.heading / 2;
  const double arc = distance(straight.truth) * (std::abs(half) < 1e-9 ? 1 : half / std::sin(half));
  BaseMultipliers out;
  for (int pass = 0; pass < kFitPasses; ++pass) {
    const double track = wheel_separation * out.separation;
    out.left_radius = (arc - half * track) / straight.rolled.back()[0];
    out.right_radius = (arc + half * track) / straight.rolled.back()[1];
    double sum = 0;
    for (const bool left : {true, false}) {
      const BaseLeg& turn = leg_of(legs, BaseLeg::Kind::turn, left);
      sum += (out.right_radius * turn.rolled.back()[1] - out.left_radius * turn.rolled.back()[0]) /
             turn.truth.heading;
    }
    out.separation = sum / 2 / wheel_separation;
  }
  return out;
}

BaseReport report_base(const Scenario& scenario, const BaseReportOptions& options, Diagnostics& diagnostics) {
  Scenario alone = scenario;
  alone.robots.resize(1);
  BaseDrive base(alone, options.controller, diagnostics);
  BaseReport report;
  report.robot = base.twin().robot().name();
  report.controller = base.topics().controller;
  report.type = base.topics().type;
  report.turns_on_spot = can_turn_on_spot(report.type);
  if (const auto of = differential(base.twin().robot(), base.topics())) {
    base.watch_wheels(of->left, of->right, of->radius);
    report.wheel_separation = of->separation;
    report.present = of->multipliers;
  }
  Survey survey(base, report.turns_on_spot);
  base.drive(kSettle, 0, 0);
  const std::pair<const char*, std::function<BaseLeg()>> legs[] = {
      {"5 m straight", [&] { return survey.straight(); }},
      {"10 rad to the left", [&] { return survey.turn(1); }},
      {"10 rad to the right", [&] { return survey.turn(-1); }},
      {"a square of 4 m to the left", [&] { return survey.square(1); }},
      {"a square of 4 m to the right", [&] { return survey.square(-1); }}};
  for (const auto& [name, drive] : legs) {
    if (options.on_leg) options.on_leg(name);
    BaseLeg leg = drive();
    if (base.diverged()) {
      report.diverged = {name, to_seconds(base.twin().now())};
      return report;
    }
    report.legs.push_back(std::move(leg));
  }
  summarise(report);
  return report;
}

}  // namespace doppel
