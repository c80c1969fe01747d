#pragma once
// The error of a base's odometry, and the multipliers of its controller that minimise the
// odometry error: the twin drives 5 m, 10 rad on the spot to each side, and a square of 4 m in each
// direction (UMBmark, Borenstein and Feng 1994), by the base's own controller and its topics.

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

struct PlanarPose {
  double x = 0, y = 0;  // m
  double heading = 0;   // rad, counts turns
};

// A motion from rest to rest, in the axes of its start.
struct DOPPEL_API BaseLeg {
  enum class Kind { straight, turn, square };
  Kind kind = Kind::straight;
  bool left = true;              // to which side a turn or square is driven
  PlanarPose truth, odometry;    // at the end
  std::vector<PlanarPose> path;  // true, at 20 Hz
  std::vector<PlanarPose> path_odometry;
  // Distances rolled by the left and the right wheels, rad times the radius of the controller without
  // multipliers: m, at 20 Hz. Of a differential base.
  std::vector<std::array<double, 2>> rolled;
  [[nodiscard]] double odometry_error() const;  // m, between the ends of odometry and truth
};

// diff_drive_controller's parameters.
struct BaseMultipliers {
  double separation = 1, left_radius = 1, right_radius = 1;
};

struct BaseReport {
  std::string robot, controller, type;
  std::vector<BaseLeg> legs;  // straight, left turn, right turn, left square, right square
  // The physics diverges in a leg: `legs` has those before it, and there are no values below but the
  // controller's.
  struct Divergence {
    std::string leg;  // "5 m straight"
    double time = 0;  // s, since the start
  };
  std::optional<Divergence> diverged;
  // On the straight: true distance over the distance of the odometry, less one; m and rad off the line.
  double slip = 0, drift = 0, drift_heading = 0;
  bool turns_on_spot = true;  // else turns and corners are arcs
  // Of diff_drive_controller alone.
  double wheel_separation = 0;                         // m
  std::optional<BaseMultipliers> present, fitted;      // as configured; that minimise the odometry error
  std::array<double, 2> square_error_fitted = {0, 0};  // m, left and right square, with `fitted`
};

struct BaseReportOptions {
  std::string controller;  // of the base; empty: the robot's only one
  // Called before each leg: "5 m straight".
  std::function<void(const std::string& leg)> on_leg;
};

// Builds a twin of the scenario's first robot and drives it. Throws InputError: no controller of a base, an
// unknown one, or a base that does not move.
DOPPEL_API BaseReport report_base(const Scenario& scenario, const BaseReportOptions& options,
                                  Diagnostics& diagnostics);

DOPPEL_API std::string base_report_text(const BaseReport& report);
DOPPEL_API std::string base_report_json(const BaseReport& report);
DOPPEL_API std::string base_report_svg(const BaseReport& report);  // the squares, truth and odometry

// The multipliers by which the wheels' distances on these legs give their true motion.
DOPPEL_API BaseMultipliers fit_multipliers(const std::vector<BaseLeg>& legs, double wheel_separation);

// Odometry of a differential base from the distances rolled by its wheels, by exact arcs.
DOPPEL_API PlanarPose integrate_odometry(const std::vector<std::array<double, 2>>& rolled,
                                         double wheel_separation, const BaseMultipliers& with);

// The text of a controllers' file in which the controller has these multipliers; all else stays as it is.
// `file` is its name in messages. Throws InputError: no such controller, or a form that cannot be edited.
DOPPEL_API std::string with_multipliers(const std::string& text, const std::filesystem::path& file,
                                        const std::string& controller, const BaseMultipliers& multipliers);

}  // namespace doppel
