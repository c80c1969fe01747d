#pragma once
// An SVG of surfaces in an orthographic view, drawn from the furthest triangle to the nearest.

#include <array>
#include <string>
#include <vector>

#include "doppel/validation/reports/detail/arm_scene.h"

namespace doppel {

// The colours of the first, second, ... named link, 0..1.
inline constexpr std::array<std::array<double, 3>, 4> kNamedColours = {
    {{0.85, 0.25, 0.28}, {0.12, 0.42, 0.72}, {0.55, 0.35, 0.65}, {0.75, 0.5, 0.1}}};

// The axes of a view: to the right, upwards, to the eye.
struct ViewAxes {
  Eigen::Vector3d right, up, eye;
};
[[nodiscard]] ViewAxes axes_of(const ArmView& view);

// The share of the picture's pixels where a named link is in front.
[[nodiscard]] double visible_share(const std::vector<LinkSurface>& surfaces, const ArmPose& pose,
                                   const ArmView& view);

[[nodiscard]] std::string arm_drawing(const std::vector<LinkSurface>& surfaces, const ArmPose& pose,
                                      const std::string& caption);

}  // namespace doppel
