#pragma once
// From a robot and a world to MJCF text. Nothing of the user's goes into the text: bodies, joints and objects
// are named by index, so that no name needs escaping and MuJoCo's messages can be told in the user's words.

#include <string>
#include <vector>

#include "doppel/physics/engine.h"
#include "doppel/physics/mujoco/collision_mesh.h"
#include "doppel/physics/mujoco/exclusions.h"

namespace doppel {

// Bodies stand in the order of Model::links and joints in that of Model::q, so that MuJoCo's arrays begin
// with the model's. A floating joint is three slides and a ball, a planar one two slides and a hinge.
std::string mjcf_link_name(int link);
std::string mjcf_joint_name(int joint);  // of the joint's first degree of freedom
std::string mjcf_object_name(int object);
std::string mjcf_shape_name(int link, int shape);
std::string mjcf_object_shape_name(int object);
std::string mjcf_exclusion_name(std::size_t pair);
// Of a link (by its place in RobotMjcf::movable_shapes) and the ground (object -1) or an object.
std::string mjcf_surrounding_name(std::size_t shape, int object);

// Up to this many pairs of shapes that may touch, each is looked at by itself; beyond it MuJoCo sorts all
// bodies along an axis in every step, which costs as much as about so many pairs (bench_loop_rate).
inline constexpr std::size_t kMostListedPairs = 400;

// The robot's part of the text, written once; the world's is written anew whenever an object comes or goes.
struct RobotMjcf {
  std::string assets, bodies, equalities;
  std::vector<bool> has_shape;   // [links]
  std::vector<int> shapes;       // [links] how many geoms
  std::vector<double> friction;  // [links] Coulomb, of the shapes
  std::vector<LinkPair> pairs;  // of links with shapes; each has an <exclude>, or a <pair> for any two shapes
  // Links with shapes that are not fixed to the world; each has an <exclude> with the ground and every
  // object, or a <pair> for each shape.
  std::vector<int> movable_shapes;
  std::vector<int> driven;  // model joints that have a drive
};

RobotMjcf write_robot(const RobotDescription& robot, const Model& model, const World& world,
                      CollisionMeshes& meshes, Diagnostics& diagnostics);

// Throws InputError where an object's mesh cannot be used.
std::string write_document(const RobotMjcf& robot, const World& world, CollisionMeshes& meshes,
                           Diagnostics& diagnostics);

// Puts the user's names into a message of MuJoCo's.
std::string in_user_terms(std::string message, const Model& model, const World& world);

}  // namespace doppel
