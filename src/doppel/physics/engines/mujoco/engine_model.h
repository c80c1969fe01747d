#pragma once
// From a world's settings and instances to MJCF text, whose bodies physics/mjcf/mjcf.h writes. Bodies, joints and
// shapes are named by index over all instances, so that no name of the user needs escaping and the names in
// MuJoCo's messages can be replaced by the user's.

#include <span>
#include <string>
#include <vector>

#include "doppel/physics/contract/exclusions.h"

namespace doppel {

// The first indices of an instance among those of all instances. Bodies have the order of Model::links,
// joints that of Model::q; a floating joint is three slides and a ball, a planar one two slides and a hinge.
// So MuJoCo's arrays are the concatenated arrays of the models.
struct InstanceOffsets {
  int link = 0, joint = 0, q = 0, v = 0;
};
std::vector<InstanceOffsets> instance_offsets(std::span<const ModelInstance> instances);

// The names in MJCF, from indices over all instances.
std::string mjcf_link_name(int link);
std::string mjcf_joint_name(int joint);  // of the joint's first degree of freedom
std::string mjcf_exclusion_name(std::size_t pair);
inline constexpr const char* kMjcfGround = "~ground";  // the shape of the ground
std::string mjcf_shape_name(int link, std::size_t shape);

// Up to this many pairs of shapes that may touch, each pair is tested individually; with more, MuJoCo sorts
// all bodies along an axis in every step, at the cost of about as many pairs (bench_loop_rate).
inline constexpr std::size_t kMaxListedPairs = 400;

struct MjcfDocument {
  std::string text;
  // Every pair that may become excluded, each an <exclude>; empty: every two shapes that may touch have a
  // <pair>, and MuJoCo tests no others.
  std::vector<std::pair<BodyId, BodyId>> exclusions;
  std::vector<SharedField>
      fields;  // of the hfield with the same index; MuJoCo reads their heights from files only
};
std::string mjcf_field_name(std::size_t field);
MjcfDocument write_document(const WorldSettings& settings, std::span<const ModelInstance> instances,
                            const Exclusions& exclusions);

// The sizes of MuJoCo's arrays of contacts and of rows of constraints. Fixed bodies have no contacts among themselves.
struct MjcfSizes {
  std::size_t robots = 0;  // instances other than objects, at least 1
  std::size_t loose = 0;   // shapes of objects that move, of each link at most as many as may touch at once
  std::size_t contacts = 0, rows = 0;
};
inline constexpr std::size_t kRowsOfRobot = 400, kRowsOfLooseShape = 24;
// MuJoCo compiles with a matrix of all rows by all rows, which states do not have. They have this many times
// the contacts and rows, as long as a matrix of all rows by all velocities needs no more than kMaxRowBytes;
// memory that no contact needs is not touched.
inline constexpr std::size_t kRoomOfStates = 5;
inline constexpr double kMaxRowBytes = 512e6;
MjcfSizes sizes_of(std::span<const ModelInstance> instances);

// Replaces indices by the user's names in a message of MuJoCo.
std::string in_user_terms(std::string message, std::span<const ModelInstance> instances);

}  // namespace doppel
