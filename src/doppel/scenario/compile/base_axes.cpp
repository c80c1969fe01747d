#include "doppel/scenario/compile/detail/base_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "doppel/scenario/resolve/controllers_file.h"

namespace doppel {
namespace {

constexpr double kAcrossBase = 0.9;  // cosine between an axle and the y axis of the base

bool drives_by_axes(const DeclaredController& controller) {
  const std::string_view type = controller.type;
  return !type.starts_with("omni_") && (type.find("_drive_controller/") != std::string_view::npos ||
                                        type.find("_steering_controller/") != std::string_view::npos ||
                                        type.starts_with("tricycle_controller/"));
}

const PlacedName* find_name(const std::vector<PlacedName>& names, const std::string& name) {
  const auto found = std::ranges::find(names, name, &PlacedName::first);
  return found == names.end() ? nullptr : &*found;
}

bool negative(const DeclaredController& controller, const char* parameter) {
  const auto value = controller.number(parameter);
  return value && value->first < 0;
}

void report_sides(const DeclaredController& controller, const std::vector<BaseWheel>& wheels,
                  Diagnostics& diagnostics) {
  for (const bool left : {true, false}) {
    const std::vector<PlacedName> names = controller.texts(left ? "left_wheel_names" : "right_wheel_names");
    for (const BaseWheel& wheel : wheels) {
      const PlacedName* const listed = find_name(names, wheel.joint);
      if (listed == nullptr) continue;
      if ((wheel.centre_B.y() > 0) != left) {
        diagnostics.warning(
            "up.base_axis", listed->second,
            fmt::format("controller '{}' lists '{}' as a {} wheel, but it is on the {} of the base: the base "
                        "turns to the "
                        "other side than commanded",
                        controller.name, wheel.joint, left ? "left" : "right", left ? "right" : "left"),
            "list it on the other side, or correct the <origin> of its joint");
      }
    }
  }
}

void report_axes(const DeclaredController& controller, const std::vector<BaseWheel>& wheels,
                 Diagnostics& diagnostics) {
  const std::vector<std::string> names = controller.named_joints();
  const auto named = [&](const std::string& joint) {
    return !joint.empty() && std::ranges::find(names, joint) != names.end();
  };
  const std::vector<PlacedName> left = controller.texts("left_wheel_names");
  for (const BaseWheel& wheel : wheels) {
    if (named(wheel.steering) && wheel.steers_right) {
      diagnostics.warning("up.base_axis", controller.where,
                          fmt::format("a positive angle of '{}' steers to the right, because its <axis> "
                                      "points down: controller '{}' turns "
                                      "the base to the other side than commanded",
                                      wheel.steering, controller.name),
                          "let its <axis> point up");
    }
    const bool reversed =
        negative(controller, find_name(left, wheel.joint) != nullptr ? "left_wheel_radius_multiplier"
                                                                     : "right_wheel_radius_multiplier");
    if (named(wheel.joint) && !reversed && wheel.axle_B.y() < -kAcrossBase) {
      diagnostics.warning("up.base_axis", controller.where,
                          fmt::format("a positive velocity of '{}' drives backwards, because its <axis> "
                                      "points to the right: controller "
                                      "'{}' drives the base otherwise than commanded",
                                      wheel.joint, controller.name),
                          "let its <axis> point to the left");
    }
  }
}

// Plain wheels under a mecanum controller scrub, and cannot move sideways.
void report_rollers(const DeclaredController& controller, const std::vector<BaseWheel>& wheels,
                    Diagnostics& diagnostics) {
  if (!controller.type.starts_with("mecanum_drive_controller/")) return;
  const std::vector<std::string> names = controller.named_joints();
  for (const BaseWheel& wheel : wheels) {
    if (std::ranges::find(names, wheel.joint) == names.end() || wheel.grip_B.norm() > 0) continue;
    diagnostics.warning(
        "up.base_rollers", controller.where,
        fmt::format("the wheels of the mecanum controller '{}', as '{}', have the same friction in every "
                    "direction, as "
                    "wheels without rollers: the base scrubs in turns and does not move sideways",
                    controller.name, wheel.joint),
        "give each wheel fdir1 along the axis of the roller on the ground, mu1, and mu2 0");
    return;
  }
}

}  // namespace

void report_base_axes(const std::vector<BaseWheel>& wheels, const ParameterFile& controllers,
                      Diagnostics& diagnostics) {
  for (const DeclaredController& controller : controllers_in(controllers).controllers) {
    if (!drives_by_axes(controller)) continue;
    report_sides(controller, wheels, diagnostics);
    report_axes(controller, wheels, diagnostics);
    report_rollers(controller, wheels, diagnostics);
  }
}

}  // namespace doppel
