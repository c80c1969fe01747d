#pragma once
// From an expanded XML tree to a RobotDescription. Errors are collected in `diagnostics`, not thrown; the
// caller stops if there are any.

#include <filesystem>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// `base`: the folder to which mesh names are relative.
DOPPEL_API RobotDescription read_urdf(const XmlNode& root, const std::filesystem::path& base,
                                      const PackageResolver& resolver, Diagnostics& diagnostics);

// The fix for a root element that is not <robot>.
DOPPEL_API std::string fix_of_root(const XmlNode& root);

// Checks the tree of links and joints: one root, no loops, known names, mimics with an effect.
DOPPEL_API void check_tree(const RobotDescription& robot, Diagnostics& diagnostics);

// <ros2_control>, <gazebo> and <transmission> (urdf_extensions.cpp).
DOPPEL_API HardwareDescription read_hardware(const XmlNode& node, Diagnostics& diagnostics);
DOPPEL_API GazeboExtension read_gazebo(const XmlNode& node, const std::filesystem::path& base,
                                       const PackageResolver& resolver, Diagnostics& diagnostics);
DOPPEL_API Transmission read_transmission(const XmlNode& node, Diagnostics& diagnostics);

}  // namespace doppel
