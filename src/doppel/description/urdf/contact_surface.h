#pragma once
// The <friction> of a collision's <surface>, which SDF has in each collision and a URDF in the <collision> of a
// <gazebo> extension. Source: SDFormat 1.11, surface/friction.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string_view>

#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// Reads the numbers in the child elements of a node, with the diagnostics of the calling reader. A child
// that is missing or cannot be read is nullopt.
struct ElementNumbers {
  std::function<std::optional<double>(const XmlNode& parent, std::string_view child)> number;
  std::function<std::optional<Eigen::Vector3d>(const XmlNode& parent, std::string_view child)> vector;
};

// Writes the values that <bullet>, <ode> (which takes precedence) and <torsional> give.
DOPPEL_API void read_friction(const XmlNode& friction, const ElementNumbers& numbers, ContactSurface& out);

}  // namespace doppel
