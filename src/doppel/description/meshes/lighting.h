#pragma once
// Lights and surroundings of a world as plain data, for everything that draws it. Source: SDFormat 1.11, light and scene.

#include <Eigen/Core>
#include <optional>
#include <string>

#include "doppel/base/core/source_location.h"
#include "doppel/base/math/pose.h"

namespace doppel {

enum class LightKind { point, directional, spot };
struct Light {
  std::string name;
  LightKind kind = LightKind::point;
  Pose X_WL = Pose::Identity();
  Eigen::Vector3d direction_W{0, 0, -1};  // of directional and spot lights, unit, world axes
  Eigen::Vector4d diffuse{1, 1, 1, 1}, specular{0.1, 0.1, 0.1, 1};  // 0..1
  double range = 10;                                                // m
  // At a distance d the light is divided by constant + linear d + quadratic d^2; directional ones ignore it.
  double attenuation_constant = 1, attenuation_linear = 1, attenuation_quadratic = 0;
  // Of spot lights: full angles of the cones of full and of no light, rad, and the exponent between them.
  double inner_angle = 0, outer_angle = 0, falloff = 0;
  double intensity = 1;
  bool cast_shadows = false;
  bool on = true;
  SourceLocation source;
};

inline constexpr const char* kLightKindNames[] = {"point", "directional", "spot"};
inline const char* name_of(LightKind kind) {
  return kLightKindNames[static_cast<int>(kind)];
}

struct Sky {
  double time = 10, sunrise = 6, sunset = 20;  // hours of the day
};

// The surroundings of the shapes of a world.
struct Environment {
  Eigen::Vector4d ambient{0.4, 0.4, 0.4, 1}, background{0.7, 0.7, 0.7, 1};  // 0..1
  bool shadows = true;
  std::optional<Sky> sky;  // instead of the background's colour
  SourceLocation source;
};

}  // namespace doppel
