#pragma once
// An entity of the world from the text that /spawn_entity gets: SDF with one <model>, read as everywhere
// (scenario/sdf/sdf_world.h), or a URDF without moving joints. A URDF with an <inertia> or with several links is
// read as a description, with all of its shapes. The only link of any other has one shape, which collides:
// that of its <collision>, or of its <visual> where there is none; its mass is distributed evenly over it.
// Elements without effect are notes.

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/physics/contract/model_instance.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {

// From a mesh's URI to a permitted file; throws InputError.
using MeshFinder = SdfMeshFinder;

struct EntityText {
  std::string name;  // of the model in the text; parts of it that no joint connects are named "name::link"
  std::variant<WorldObject, std::vector<SdfModel>> made_of;  // of a URDF, of an SDF; poses as in the text
};

// Throws InputError with all errors, at "xml:LINE:COLUMN": invalid XML, no or several models, unrealistic sizes
// and masses.
EntityText read_entity_xml(std::string_view xml, const MeshFinder& find_mesh, Diagnostics& notes);

// Under another name, in the world. X_WE: the frame in which the text's poses are. Throws InputError.
std::vector<ModelInstance> instances_of(const EntityText& entity, const std::string& name, const Pose& X_WE,
                                        Diagnostics& notes);

// The name of the robot that the text describes: a URDF with a joint that moves, with <ros2_control>, or with
// sensors or plugins. Empty: an object, or invalid text.
std::string robot_in_xml(std::string_view xml);
// <gazebo><doppel:base>fixed or floating</doppel:base></gazebo> of a URDF, as `doppel spawn --base` sends it;
// nullopt: not written. Throws InputError for another value.
std::optional<BaseKind> base_in_xml(std::string_view xml);

}  // namespace doppel
