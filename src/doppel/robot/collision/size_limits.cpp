#include "doppel/robot/collision/size_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace doppel {
namespace {

constexpr double kMinMeshScale = 1e-6, kMaxMeshScale = 1e6;

struct NamedSize {
  const char* name;
  double value;  // m
};

std::vector<NamedSize> sizes_of(const Geometry& shape) {
  if (const auto* box = std::get_if<Box>(&shape))
    return {{"side", box->size.x()}, {"side", box->size.y()}, {"side", box->size.z()}};
  if (const auto* of = std::get_if<Cylinder>(&shape)) return {{"radius", of->radius}, {"length", of->length}};
  if (const auto* of = std::get_if<Capsule>(&shape)) return {{"radius", of->radius}, {"length", of->length}};
  if (const auto* of = std::get_if<Sphere>(&shape)) return {{"radius", of->radius}};
  if (const auto* of = std::get_if<Ellipsoid>(&shape))
    return {{"radius", of->radii.x()}, {"radius", of->radii.y()}, {"radius", of->radii.z()}};
  if (const auto* of = std::get_if<Cone>(&shape)) return {{"radius", of->radius}, {"length", of->length}};
  if (const auto* of = std::get_if<Extrusion>(&shape)) return {{"height", of->height}};
  return {};
}

}  // namespace

void check_range(const char* what, double value, double low, double high, const char* unit, const char* rule,
                 const SourceLocation& where, Diagnostics& errors) {
  if (value >= low && value <= high) return;
  errors.error(rule, where,
               fmt::format("the {} is {:g}{}{}; it must be from {:g} to {:g}", what, value,
                           *unit == 0 ? "" : " ", unit, low, high),
               *unit == 0 ? "" : fmt::format("write it in {}", unit));
}

void check_sizes(const Geometry& shape, const char* rule, const SourceLocation& where, Diagnostics& errors) {
  for (const NamedSize& size : sizes_of(shape))
    check_range(size.name, size.value, kMinShapeSize, kMaxShapeSize, "m", rule, where, errors);
  if (const auto* extrusion = std::get_if<Extrusion>(&shape)) {
    for (const Eigen::Vector2d& p : extrusion->outline)
      check_range("distance", p.cwiseAbs().maxCoeff(), 0, kMaxShapeSize, "m", rule, where, errors);
  }
  if (const auto* mesh = std::get_if<MeshGeometry>(&shape)) {
    for (const double scale : mesh->scale)
      check_range("scale", std::fabs(scale), kMinMeshScale, kMaxMeshScale, "", rule, where, errors);
  }
}

void check_mass(double mass, const char* rule, const SourceLocation& where, Diagnostics& errors) {
  check_range("mass", mass, kMinBodyMass, kMaxBodyMass, "kg", rule, where, errors);
}

void check_distance(const Pose& pose, const char* rule, const SourceLocation& where, Diagnostics& errors) {
  check_range("distance", pose.translation().cwiseAbs().maxCoeff(), 0, kMaxDistance, "m", rule, where,
              errors);
}

SizeSpan size_span(const Geometry& shape) {
  const std::vector<NamedSize> sizes = sizes_of(shape);
  if (sizes.empty()) return {};
  const auto [least, most] = std::ranges::minmax(sizes, {}, &NamedSize::value);
  return {least.value, most.value};
}

}  // namespace doppel
