#include "doppel/review/conversion/tree_labels.h"

#include <fmt/format.h>

#include <array>

#include "doppel/review/conversion/detail/quantities.h"

namespace doppel {
namespace {

std::string short_number(double value) {
  const std::string text = fmt::format("{:.4g}", value);
  return text == "-0" ? "0" : text;
}

// Without zeros at the end, and without a minus before zero.
std::string rounded(double value, int digits) {
  std::string text = fmt::format("{:.{}f}", value, digits);
  while (text.find('.') != std::string::npos && text.ends_with('0')) text.pop_back();
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

}  // namespace

std::string type_word(JointType type) {
  constexpr std::array<const char*, 6> words = {"fixed",     "revolute", "continuous",
                                                "prismatic", "floating", "planar"};
  return words[static_cast<std::size_t>(type)];
}

bool turns(JointType type) {
  return type == JointType::revolute || type == JointType::continuous;
}

std::string axis_word(const Eigen::Vector3d& axis) {
  for (int i = 0; i < 3; ++i) {
    for (const double sign : {1.0, -1.0}) {
      if ((axis - sign * Eigen::Vector3d::Unit(i)).norm() < 1e-6)
        return std::string(sign < 0 ? "-" : "") + "xyz"[i];
    }
  }
  return short_numbers(axis);
}

std::string short_numbers(const Eigen::Vector3d& v) {
  return short_number(v.x()) + " " + short_number(v.y()) + " " + short_number(v.z());
}

std::string millimetres_word(const Eigen::Vector3d& v) {
  return rounded(v.x() * 1e3, 1) + " " + rounded(v.y() * 1e3, 1) + " " + rounded(v.z() * 1e3, 1) + " mm";
}

std::string degrees_word(const Eigen::Vector3d& rpy) {
  // A hundredth of a degree is finer than any relevant angle.
  return rounded(rpy.x() * kDegreesPerRadian, 2) + " " + rounded(rpy.y() * kDegreesPerRadian, 2) + " " +
         rounded(rpy.z() * kDegreesPerRadian, 2);
}

std::string limits_word(const Joint& joint) {
  const bool limited = joint.type == JointType::revolute || joint.type == JointType::prismatic;
  if (!limited || !joint.limits || !joint.limits->has_position) return "";
  const double scale = turns(joint.type) ? kDegreesPerRadian : 1.0;
  const auto number = [&](double value) {
    return turns(joint.type) ? fmt::format("{:.0f}", value * scale) : short_number(value);
  };
  return number(joint.limits->lower) + ".." + number(joint.limits->upper) +
         (turns(joint.type) ? "\u00B0" : " m");
}

std::string mass_word(double kilograms) {
  if (kilograms >= 2) return fmt::format("{:.4g} kg", kilograms);
  const double grams = kilograms * 1e3;
  return (grams >= 100 ? rounded(grams, 1) : short_number(grams)) + " g";
}

std::string mass_word(const Link& link) {
  return link.inertial ? mass_word(link.inertial->mass) : "";
}

Tone joint_tone(JointType type) {
  switch (type) {
    case JointType::fixed:
      return Tone::fixed;
    case JointType::revolute:
      return Tone::revolute;
    case JointType::continuous:
      return Tone::continuous;
    case JointType::prismatic:
      return Tone::prismatic;
    case JointType::floating:
    case JointType::planar:
      break;
  }
  return Tone::other;
}

std::string headline(const RobotDescription& robot) {
  std::array<int, 6> counts{};
  for (const Joint& joint : robot.joints) ++counts[static_cast<std::size_t>(joint.type)];
  std::string types;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    types +=
        fmt::format("{}{} {}", types.empty() ? "" : ", ", counts[i], type_word(static_cast<JointType>(i)));
  }
  double mass = 0;
  for (const Link& link : robot.links) mass += link.inertial ? link.inertial->mass : 0.0;
  const auto plural = [](std::size_t count) { return count == 1 ? "" : "s"; };
  return fmt::format("{}: {} link{}, {} joint{}{}, {}", robot.name, robot.links.size(),
                     plural(robot.links.size()), robot.joints.size(), plural(robot.joints.size()),
                     types.empty() ? "" : " (" + types + ")", mass_word(mass));
}

}  // namespace doppel
