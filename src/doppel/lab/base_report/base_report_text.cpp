// A base's report as text, JSON and picture.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "doppel/lab/base_report/base_report.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kAccurate = 2e-3;                           // of multipliers, relative
constexpr double kPicture = 720, kMargin = 60, kTitle = 70;  // px

std::string name_of(const BaseLeg& leg, bool on_spot) {
  const char* const side = leg.left ? "left" : "right";
  switch (leg.kind) {
    case BaseLeg::Kind::straight:
      return "straight";
    case BaseLeg::Kind::turn:
      return fmt::format("{} {}", on_spot ? "turn" : "arc", side);
    case BaseLeg::Kind::square:
      return fmt::format("square {}", side);
  }
  return "";
}

std::string end_of(const PlanarPose& pose) {
  return fmt::format("{:8.3f} {:8.3f} m {:8.1f} deg", pose.x, pose.y, pose.heading * kDegrees);
}

bool differ(const BaseMultipliers& a, const BaseMultipliers& b) {
  return std::max({std::abs(a.separation / b.separation - 1), std::abs(a.left_radius / b.left_radius - 1),
                   std::abs(a.right_radius / b.right_radius - 1)}) > kAccurate;
}

std::string multipliers_text(const BaseReport& report) {
  const BaseMultipliers &now = *report.present, &fitted = *report.fitted;
  std::string out = fmt::format("\n{:<32}{:>10}{:>10}\n", "multipliers", "now", "fitted");
  const auto row = [&out](const char* name, double before, double after) {
    out += fmt::format("  {:<30}{:>10.4f}{:>10.4f}\n", name, before, after);
  };
  row("wheel_separation_multiplier", now.separation, fitted.separation);
  row("left_wheel_radius_multiplier", now.left_radius, fitted.left_radius);
  row("right_wheel_radius_multiplier", now.right_radius, fitted.right_radius);
  out += fmt::format(
      "With the fitted ones, the error after the squares is {:.1f} mm (left) and {:.1f} mm (right).\n",
      1e3 * report.square_error_fitted[0], 1e3 * report.square_error_fitted[1]);
  return out + (differ(now, fitted) ? "Write them into the controllers' file with --write.\n"
                                    : "The configured multipliers are accurate.\n");
}

Json pose_json(const PlanarPose& pose) {
  return {{"x", pose.x}, {"y", pose.y}, {"heading", pose.heading}};
}

Json multipliers_json(const BaseMultipliers& of) {
  return {{"wheel_separation_multiplier", of.separation},
          {"left_wheel_radius_multiplier", of.left_radius},
          {"right_wheel_radius_multiplier", of.right_radius}};
}

// The square that a path covers, in px.
struct Frame {
  double left = 1e9, right = -1e9, low = 1e9, high = -1e9;
  void take(const std::vector<PlanarPose>& path) {
    for (const PlanarPose& pose : path) {
      left = std::min(left, pose.x);
      right = std::max(right, pose.x);
      low = std::min(low, pose.y);
      high = std::max(high, pose.y);
    }
  }
  [[nodiscard]] double scale() const {
    return (kPicture - 2 * kMargin) / std::max({right - left, high - low, 0.1});
  }
  [[nodiscard]] std::string line(const std::vector<PlanarPose>& path, const char* style) const {
    std::string points;
    for (const PlanarPose& pose : path) {
      points += fmt::format("{:.1f},{:.1f} ", kMargin + scale() * (pose.x - left),
                            kTitle + kMargin + scale() * (high - pose.y));
    }
    return fmt::format("<polyline fill=\"none\" {} points=\"{}\"/>\n", style, points);
  }
};

std::string words(double x, double y, int size, const std::string& text, const char* color = "#222") {
  return fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" fill=\"{}\">{}</text>\n", x, y, size, color,
                     text);
}

}  // namespace

std::string base_report_text(const BaseReport& report) {
  std::string out =
      fmt::format("{}: {} ({}) on the ground of its world\n\n", report.robot, report.controller, report.type);
  out += fmt::format("{:<14}{:<33}{:<33}{}\n", "", "    final pose (true)", "    final pose (odometry)",
                     "error");
  for (const BaseLeg& leg : report.legs) {
    out += fmt::format("{:<14}{}   {}  {:7.1f} mm {:6.2f} deg\n", name_of(leg, report.turns_on_spot),
                       end_of(leg.truth), end_of(leg.odometry), 1e3 * leg.odometry_error(),
                       (leg.odometry.heading - leg.truth.heading) * kDegrees);
  }
  if (report.diverged) {
    return out +
           fmt::format(
               "\nThe simulation diverges {:.3f} s after the start, in the leg: {}. doppel verify shows "
               "why.\n",
               report.diverged->time, report.diverged->leg);
  }
  out += fmt::format(
      "\nSlip: on the straight the base goes {:.3f} % {} far than its odometry says, and {:.1f} mm and "
      "{:.2f} deg "
      "off the line.\n",
      100 * std::abs(report.slip), report.slip < 0 ? "less" : "more", 1e3 * std::abs(report.drift),
      std::abs(report.drift_heading) * kDegrees);
  if (report.fitted) out += multipliers_text(report);
  return out;
}

std::string base_report_json(const BaseReport& report) {
  Json out{{"robot", report.robot}, {"controller", report.controller}, {"type", report.type}};
  if (report.diverged) {
    out["diverged"] = {{"leg", report.diverged->leg}, {"time", report.diverged->time}};
  } else {
    out["slip"] = report.slip;
    out["drift"] = report.drift;
    out["drift_heading"] = report.drift_heading;
  }
  for (const BaseLeg& leg : report.legs) {
    out["legs"].push_back({{"name", name_of(leg, report.turns_on_spot)},
                           {"truth", pose_json(leg.truth)},
                           {"odometry", pose_json(leg.odometry)}});
  }
  if (report.fitted) {
    out["present"] = multipliers_json(*report.present);
    out["fitted"] = multipliers_json(*report.fitted);
    out["square_error_fitted"] = report.square_error_fitted;
  }
  return out.dump(2) + "\n";
}

std::string base_report_svg(const BaseReport& report) {
  Frame frame;
  for (const BaseLeg& leg : report.legs) {
    if (leg.kind != BaseLeg::Kind::square) continue;
    frame.take(leg.path);
    frame.take(leg.path_odometry);
  }
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      kPicture, kPicture + kTitle);
  out += words(kMargin, 36, 20, fmt::format("{}: squares of 4 m in both directions", report.robot));
  out += words(kMargin, 60, 14, "true path", "#d95f02");
  out += words(kMargin + 90, 60, 14, "path by odometry", "#1f6fb4");
  for (const BaseLeg& leg : report.legs) {
    if (leg.kind != BaseLeg::Kind::square) continue;
    out += frame.line(leg.path, "stroke=\"#d95f02\" stroke-width=\"3\"");
    out += frame.line(leg.path_odometry, "stroke=\"#1f6fb4\" stroke-width=\"1.5\" stroke-dasharray=\"6 4\"");
  }
  out += fmt::format(
      "<line x1=\"{0}\" y1=\"{1}\" x2=\"{2:.1f}\" y2=\"{1}\" stroke=\"#222\" stroke-width=\"2\"/>\n", kMargin,
      kPicture + kTitle - 22, kMargin + frame.scale());
  out += words(kMargin, kPicture + kTitle - 30, 13, "1 m");
  return out + "</svg>\n";
}

}  // namespace doppel
