#pragma once
// The one reader of SDF (descriptions of robots are URDF, worlds are YAML, and SDF is otherwise only
// written): an object of the world from the text that /spawn_entity gets: SDF (one <model> with one <link>)
// or URDF (one <link>). It has one shape, which collides: that of its <collision>, or of its <visual> where
// there is none; its mass is spread evenly over it. What has no effect here is noted. Source: SDFormat 1.9.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "doppel/core/diagnostic.h"
#include "doppel/physics/world.h"

namespace doppel {

// From a mesh's URI to a file that may be read; throws InputError.
using MeshFinder = std::function<std::filesystem::path(const std::string& uri)>;

// X_WO is the pose that the text gives (of the model's frame), the name its own. Throws InputError with all
// that is wrong, at "xml:LINE:COLUMN": bad XML, two links or shapes, unknown shapes, sizes and masses that no
// thing has.
WorldObject read_entity_xml(std::string_view xml, const MeshFinder& find_mesh, Diagnostics& notes);

// The name of the robot that the text describes: a URDF of several links, or with a <ros2_control>. Empty: it
// describes an object, or nothing that can be read.
std::string robot_in_xml(std::string_view xml);

}  // namespace doppel
