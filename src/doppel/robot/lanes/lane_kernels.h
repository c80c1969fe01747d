#pragma once
// The kernels of this module, for the processor that runs them. They are plain functions of plain numbers:
// their modules are compiled for one instruction set each, and all compute the same bits.
//
// A pose is twelve numbers: the rotation by rows, then the origin, m.

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "doppel/export.h"

namespace doppel {

inline constexpr int kLaneCount = 8;
// The kernels keep a chain in arrays of this size.
inline constexpr int kMaxChainVariables = 32, kMaxChainJoints = 64;

struct LaneJoint {
  double X_PZ[12];
  double multiplier, offset;
  int variable;
  bool prismatic;
};

// A Chain (chain.h) for kernels.
struct LaneChain {
  const LaneJoint* joints;
  int joint_count, variable_count;
  bool direct;
  double X_ZT[12];
  const double* lower;  // [variables] rad or m
  const double* upper;
};

// The part of a target pose that counts besides its position.
enum class IkTask : std::uint8_t {
  pose,      // the whole rotation: six numbers
  axis,      // the direction of the tool's axis, the rotation about it is free: five
  angle,     // the angle between the tool's axis and a reference axis: four
  position,  // nothing: three
};

// A search for configurations whose tip is in target poses: damped least squares from many starts, one in
// each lane. Source: Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt
// method", IEEE T-RO 27(5), 2011 (damping by the residual); joints at a limit that the step would leave are
// held.
struct LaneSearch {
  const LaneChain* chain;
  IkTask task;
  double tool_axis[3];       // unit, in the tip; for tasks axis and angle
  double reference_axis[3];  // unit, in the base; for task angle
  const double* targets;     // [targets][12] X_BT
  int target_count;
  // Attempt k of a target starts at starts[k], or, with `seeds`, attempt 0 at its seed and k at starts[k -
  // 1].
  const double* seeds;   // [targets][variables], nullptr: none
  const double* starts;  // [start_count][variables]
  int start_count;
  int max_iterations;         // of one attempt
  double position_tolerance;  // m
  double rotation_tolerance;  // rad
  double length;              // m that count as much as one rad
  bool every_attempt;         // false: a target ends with its first solution
  // True: every attempt ends with the nearest pose that it comes to, by the sum of the squares of position /
  // length and rotation_weight * rotation; source: Marquardt 1963.
  bool nearest;
  double rotation_weight;

  // Results, [targets] without every_attempt, else [targets][attempts]:
  double* q;          // [..][variables]
  int* attempt;       // the attempt that has found it; -1: none
  double* residuals;  // [..][2], for nearest: m, and 2 sin(angle / 2)
};

// -- clearance: bodies of spheres on a tree of joints, and solids that stand still.

// A joint of a tree that moves, as in LaneChain, behind joint `parent` of the same list; -1: the root.
struct LaneTreeJoint {
  LaneJoint joint;
  int parent;
};

// m, in the frame Z of the body's joint, or in the root. Floats: radii have a margin for the errors of the
// kernel (clearance_error), so that what is called free is free.
struct LaneSphere {
  float x, y, z, radius;
};

enum class LaneSolidKind : std::uint8_t { box, cylinder, half_space };

// Bodies that stand still and have a formula, in the root. A box with a rounding is its sum with a ball: a
// sphere is one without sides, a capsule one with one side. The sizes of a cylinder are radius, unused,
// half of the length. The third axis of a half space is its outward normal, at `centre`.
struct LaneSolid {
  float centre[3], axes[9];  // the axes by rows
  float sizes[3], rounding;  // m; sizes: halves of the sides
  LaneSolidKind kind;
};

inline constexpr int kCoverLevels = 2;  // besides the bounding sphere

// Spheres, and of a body that stands still also solids, which take part at both levels.
struct LaneBody {
  int joint;  // in the list; -1: it stands still
  LaneSphere bound;
  int first[kCoverLevels], count[kCoverLevels];  // in LaneTree::spheres
  int first_solid, solid_count;
};

struct LanePair {
  int a, b;  // bodies; a moves
};

// Bodies that one joint moves, or one that stands still, with a sphere around their bounds; its radius is
// negative if one of them has no bound.
struct LaneGroup {
  int joint;
  LaneSphere bound;
};

// Pairs that follow each other and are of the same two groups: apart if the groups are.
struct LaneRun {
  int a, b;  // groups; a moves
  int first, count;
};

struct LaneTree {
  const LaneTreeJoint* joints;  // parents first
  const LaneBody* bodies;
  const LaneSphere* spheres;
  const LaneSolid* solids;
  const LanePair* pairs;
  const LaneGroup* groups;
  const LaneRun* runs;  // of all pairs
  int joint_count, body_count, sphere_count, pair_count, group_count, run_count, variable_count;
};

struct LaneRuns {
  std::vector<LaneGroup> groups;
  std::vector<LaneRun> runs;
};
// Pairs of the same groups make one run where they follow each other (run_order).
DOPPEL_API LaneRuns lane_runs(std::span<const LaneBody> bodies, std::span<const LanePair> pairs);
// The groups of a pair, by which pairs are sorted so that there are few runs.
DOPPEL_API std::pair<int, int> run_order(std::span<const LaneBody> bodies, const LanePair& pair);

// A bound of the error of the kernel in float over R, of the place of a sphere behind that many joints, which
// is at most R from the root along the offsets of its joints.
constexpr double clearance_error(int joints) {
  return (48.0 * joints + 32.0) / (1 << 24);
}

// Which pairs of bodies may touch in `count` configurations, one in each lane. A pair that is in no lane's
// bits is apart by its spheres, with `clearance` and over the span: by more than rate * span + clearance.
struct LaneClearance {
  const LaneTree* tree;
  const double* u;  // [count][variables]
  int count;        // 1 to the width of the kernel
  int levels;       // 0: bounding spheres only, 1, 2
  // A span around each configuration; nullptr: none.
  const float* rates;     // [pairs] m that a pair moves at most per unit of span
  const float* spans;     // [count]
  const float* paddings;  // [pairs] m; nullptr: none
  // True: ends when every lane has a pair that may touch; the pairs that are left are not tested.
  bool until_decided;
  void* memory;  // clearance_memory() bytes, at an address divisible by 64

  std::uint32_t* touching;  // [pairs] result: a bit for each lane
};

struct DOPPEL_API LaneKernels {
  // The number of iterations of all lanes.
  long (*search)(const LaneSearch& search);
  // X_BT [count][12] of configurations [count][variables].
  void (*tip_poses)(const LaneChain& chain, const double* u, int count, double* poses);
  // The lanes with a pair that may touch, a bit for each, for up to 8 and up to 16 configurations.
  std::uint32_t (*clearance_8)(const LaneClearance& query);
  std::uint32_t (*clearance_16)(const LaneClearance& query);
};

// Bytes, for both widths.
DOPPEL_API std::size_t clearance_memory(const LaneTree& tree);

// The kernels of the widest registers that the processor has and that are installed. Throws MissingModule.
DOPPEL_API const LaneKernels& lane_kernels();

// The kernels of one module (modules_for_processor()), for tests that compare them.
DOPPEL_API const LaneKernels& lane_kernels(const char* module);

}  // namespace doppel
