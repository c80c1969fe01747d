#pragma once
// The one reader of SDF (descriptions of robots are URDF, worlds are YAML, and SDF is otherwise only
// written): an object of the world from the text that /spawn_entity gets: SDF (one <model> with one
// <link>) or URDF (one <link>). It has one shape, which collides: that of its <collision>, or of its
// <visual> where there is none; its mass is distributed evenly over it. Elements without effect are notes.
// Source: SDFormat 1.9.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "doppel/core/diagnostic.h"
#include "doppel/physics/world.h"

namespace doppel {

// From a mesh's URI to a permitted file; throws InputError.
using MeshFinder = std::function<std::filesystem::path(const std::string& uri)>;

// X_WO is the pose of the model's frame in the text, and the name that of the text. Throws InputError
// with all errors, at "xml:LINE:COLUMN": invalid XML, two links or shapes, unknown shapes, unrealistic
// sizes and masses.
WorldObject read_entity_xml(std::string_view xml, const MeshFinder& find_mesh, Diagnostics& notes);

// The name of the robot that the text describes: a URDF with several links, or with <ros2_control>. Empty: an
// object, or invalid text.
std::string robot_in_xml(std::string_view xml);

}  // namespace doppel
