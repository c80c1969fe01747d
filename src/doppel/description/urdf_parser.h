#pragma once
// From an expanded XML tree to a RobotDescription. Faults are collected; the caller stops where there are
// errors.

#include <filesystem>

#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/packages/package_resolver.h"
#include "doppel/xml/xml.h"

namespace doppel {

// `base`: the folder that relative mesh names start from.
DOPPEL_API RobotDescription read_urdf(const XmlNode& root, const std::filesystem::path& base,
                                      const PackageResolver& resolver, Diagnostics& diagnostics);

// The tree that the joints make of the links: one root, no loops, known names, mimics that lead somewhere.
DOPPEL_API void check_tree(const RobotDescription& robot, Diagnostics& diagnostics);

// <ros2_control>, <gazebo> and <transmission> (urdf_extensions.cpp).
DOPPEL_API HardwareDescription read_hardware(const XmlNode& node, Diagnostics& diagnostics);
DOPPEL_API GazeboExtension read_gazebo(const XmlNode& node, const std::filesystem::path& base,
                                       const PackageResolver& resolver, Diagnostics& diagnostics);
DOPPEL_API Transmission read_transmission(const XmlNode& node, Diagnostics& diagnostics);

}  // namespace doppel
