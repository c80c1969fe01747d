// LaneClearance: the same bits in every module (planning.md P14), and never apart where doubles say near.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "doppel/base/core/plugin_module.h"
#include "doppel/robot/lanes/lane_kernels.h"

namespace doppel {
namespace {

constexpr unsigned kTreeSeed = 5;
constexpr int kTreeJoints = 6, kSpheresOfBody = 9, kTreeSolids = 12, kLaneStates = 16, kTreeRounds = 40;

// Six revolute and prismatic joints in a chain with a branch, a body of spheres on each, and solids around
// them.
struct RandomTree {
  std::mt19937_64 random{kTreeSeed};
  std::vector<LaneTreeJoint> joints;
  std::vector<LaneBody> bodies;
  std::vector<LaneSphere> spheres;
  std::vector<LaneSolid> solids;
  std::vector<LanePair> pairs;
  LaneRuns runs;

  double number(double low, double high) { return std::uniform_real_distribution(low, high)(random); }

  RandomTree() {
    for (int i = 0; i < kTreeJoints; ++i) add_joint(i);
    for (int i = 0; i < kTreeSolids; ++i) add_solid(i);
    for (int i = 0; i < kTreeJoints; i += 2) add_body(i);  // beside the first one of the joint
    for (int a = 0; a < kTreeJoints; ++a) {
      for (int b = a + 2; b < static_cast<int>(bodies.size()); ++b) {
        if (bodies[static_cast<std::size_t>(b)].joint != a) pairs.push_back({a, b});
      }
    }
    std::ranges::stable_sort(pairs, {}, [this](const LanePair& pair) { return run_order(bodies, pair); });
    runs = lane_runs(bodies, pairs);
  }

  void add_joint(int i) {
    LaneTreeJoint joint{};
    const double angle = number(-3, 3), c = std::cos(angle), s = std::sin(angle);
    const double X[12] = {c, 0, s, 0, 1, 0, -s, 0, c, number(-0.2, 0.2), number(-0.1, 0.1), 0.3};
    std::copy(X, X + 12, joint.joint.X_PZ);
    joint.joint.multiplier = i == 4 ? -0.5 : 1;
    joint.joint.offset = i == 4 ? 0.1 : 0;
    joint.joint.variable = i == 4 ? 3 : std::min(i, 4);
    joint.joint.prismatic = i == 2;
    joint.parent = i == 5 ? 2 : i - 1;
    joints.push_back(joint);
    add_body(i);
  }

  void add_body(int i) {
    LaneBody body{i, sphere(0), {}, {}, 0, 0};
    body.bound = {0, 0, 0, 0.3F};
    for (int level = 0; level < kCoverLevels; ++level) {
      body.first[level] = static_cast<int>(spheres.size());
      body.count[level] = kSpheresOfBody;
      for (int k = 0; k < kSpheresOfBody; ++k) spheres.push_back(sphere(0.1));
    }
    bodies.push_back(body);
  }

  LaneSphere sphere(double size) {
    return {static_cast<float>(number(-size, size)), static_cast<float>(number(-size, size)),
            static_cast<float>(number(-size, size)), static_cast<float>(number(0.01, 0.08))};
  }

  void add_solid(int i) {
    LaneSolid solid{};
    const double angle = number(-3, 3), c = std::cos(angle), s = std::sin(angle);
    const double axes[9] = {c, s, 0, -s, c, 0, 0, 0, 1};
    for (int k = 0; k < 9; ++k) solid.axes[k] = static_cast<float>(axes[k]);
    for (int k = 0; k < 3; ++k) {
      solid.centre[k] = static_cast<float>(number(-1, 1));
      solid.sizes[k] = static_cast<float>(number(0.02, 0.2));
    }
    solid.rounding = static_cast<float>(i % 2 == 0 ? 0 : 0.03);
    solid.kind = static_cast<LaneSolidKind>(i % 3);
    if (solid.kind == LaneSolidKind::half_space) solid.centre[2] = -1.2F;
    LaneBody body{};
    body.joint = -1;
    body.bound.radius = -1;
    body.first_solid = static_cast<int>(solids.size());
    body.solid_count = 1;
    solids.push_back(solid);
    bodies.push_back(body);
  }

  [[nodiscard]] LaneTree tree() const {
    return {joints.data(),
            bodies.data(),
            spheres.data(),
            solids.data(),
            pairs.data(),
            runs.groups.data(),
            runs.runs.data(),
            kTreeJoints,
            static_cast<int>(bodies.size()),
            static_cast<int>(spheres.size()),
            static_cast<int>(pairs.size()),
            static_cast<int>(runs.groups.size()),
            static_cast<int>(runs.runs.size()),
            5};
  }
};

struct LaneOutcome {
  std::uint32_t lanes = 0;
  std::vector<std::uint32_t> pairs;
  bool operator==(const LaneOutcome&) const = default;
};

LaneOutcome lane_outcome(const LaneKernels& kernels, const LaneTree& tree, const std::vector<double>& u,
                         int count, LaneClearance query, bool wide) {
  std::vector<char> memory(clearance_memory(tree) + 64);
  void* aligned = memory.data();
  std::size_t space = memory.size();
  std::align(64, clearance_memory(tree), aligned, space);
  LaneOutcome out;
  out.pairs.assign(static_cast<std::size_t>(tree.pair_count), 0);
  query.tree = &tree;
  query.u = u.data();
  query.count = count;
  query.memory = aligned;
  query.touching = out.pairs.data();
  out.lanes = wide ? kernels.clearance_16(query) : kernels.clearance_8(query);
  return out;
}

TEST(ClearanceLanes, EveryModuleAndWidthFindsSamePairs) {
  SCOPED_TRACE("seed 5");
  RandomTree scene;
  const LaneTree tree = scene.tree();
  std::vector<float> rates, spans, paddings;
  for (int i = 0; i < tree.pair_count; ++i) {
    rates.push_back(static_cast<float>(scene.number(0, 0.5)));
    paddings.push_back(static_cast<float>(scene.number(0, 0.02)));
  }
  for (int i = 0; i < kLaneStates; ++i) spans.push_back(static_cast<float>(scene.number(0, 0.1)));
  int touching = 0, apart = 0;
  for (int round = 0; round < kTreeRounds; ++round) {
    std::vector<double> u;
    for (int i = 0; i < kLaneStates * tree.variable_count; ++i) u.push_back(scene.number(-1.5, 1.5));
    for (const bool moving : {false, true}) {
      LaneClearance query{};
      query.levels = round % 3;
      query.rates = moving ? rates.data() : nullptr;
      query.spans = moving ? spans.data() : nullptr;
      query.paddings = moving ? paddings.data() : nullptr;
      query.until_decided = round % 4 == 3;
      const LaneOutcome plain =
          lane_outcome(lane_kernels("doppel_lane_kernels"), tree, u, kLaneStates, query, true);
      for (const std::string& module : modules_for_processor("doppel_lane_kernels")) {
        const LaneKernels& kernels = lane_kernels(module.c_str());
        ASSERT_EQ(lane_outcome(kernels, tree, u, kLaneStates, query, true), plain) << module;
        if (query.until_decided) continue;
        const LaneOutcome narrow = lane_outcome(kernels, tree, u, 8, query, false);
        ASSERT_EQ(narrow.lanes, plain.lanes & 0xFF) << module;
        for (std::size_t p = 0; p < plain.pairs.size(); ++p)
          ASSERT_EQ(narrow.pairs[p], plain.pairs[p] & 0xFF);
        ASSERT_EQ(lane_outcome(kernels, tree, u, 3, query, false).lanes, plain.lanes & 7) << module;
      }
      touching += plain.lanes != 0 ? 1 : 0;
      apart += plain.lanes != 0xFFFF ? 1 : 0;
    }
  }
  EXPECT_GT(touching, 0);
  EXPECT_GT(apart, 0);
}

// X_KZ of the joints in double.
std::vector<Eigen::Isometry3d> poses_in_double(const LaneTree& tree, const double* u) {
  std::vector<Eigen::Isometry3d> out;
  for (int i = 0; i < tree.joint_count; ++i) {
    const LaneJoint& joint = tree.joints[i].joint;
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) X.linear()(row, column) = joint.X_PZ[row * 3 + column];
      X.translation()[row] = joint.X_PZ[9 + row];
    }
    if (tree.joints[i].parent >= 0) X = out[static_cast<std::size_t>(tree.joints[i].parent)] * X;
    const double q = joint.multiplier * u[joint.variable] + joint.offset;
    if (joint.prismatic) {
      X.translate(Eigen::Vector3d(0, 0, q));
    } else {
      X.rotate(Eigen::AngleAxisd(q, Eigen::Vector3d::UnitZ()));
    }
    out.push_back(X);
  }
  return out;
}

// The margin of lane_kernels.h: balls that touch in double are never apart in float, and balls that are apart
// by twice the margin are never near.
TEST(ClearanceLanes, TouchingBallsAreNeverApart) {
  SCOPED_TRACE("seed 5");
  RandomTree scene;
  constexpr double kReach = 4;  // m, not less than the offsets' sum
  const double margin = clearance_error(kTreeJoints) * kReach;
  LaneTree tree = scene.tree();
  const LanePair pair{4, 5};
  tree.pairs = &pair;
  tree.pair_count = 1;
  for (int round = 0; round < 2000; ++round) {
    std::vector<double> u;
    for (int v = 0; v < tree.variable_count; ++v)
      u.push_back(scene.number(-1, 1) * (v == 2 ? 1 : round % 7 + 1));
    LaneSphere a = scene.sphere(0.3), b = scene.sphere(0.3);
    const auto X = poses_in_double(tree, u.data());
    const double distance =
        (X[4] * Eigen::Vector3d(a.x, a.y, a.z) - X[5] * Eigen::Vector3d(b.x, b.y, b.z)).norm();
    for (const bool touching : {true, false}) {
      a.radius = static_cast<float>(distance / 3 + (touching ? margin : -margin));
      b.radius = static_cast<float>(distance * 2 / 3 + (touching ? margin : -margin));
      scene.bodies[4].bound = a;
      scene.bodies[5].bound = b;
      const LaneRuns runs = lane_runs(scene.bodies, {&pair, 1});
      tree.groups = runs.groups.data();
      tree.runs = runs.runs.data();
      tree.run_count = 1;
      const LaneOutcome found = lane_outcome(lane_kernels(), tree, u, 1, LaneClearance{}, round % 2 == 0);
      ASSERT_EQ(found.lanes, touching ? 1U : 0U) << round;
    }
  }
}

// Groups only spare work: one run for each pair finds the same lanes.
TEST(ClearanceLanes, RunsOfGroupsFindWhatSinglePairsFind) {
  SCOPED_TRACE("seed 5");
  RandomTree scene;
  const LaneTree tree = scene.tree();
  ASSERT_LT(tree.run_count, tree.pair_count);
  LaneRuns single = scene.runs;
  single.runs.clear();
  for (const LaneRun& run : scene.runs.runs) {
    for (int k = 0; k < run.count; ++k) single.runs.push_back({run.a, run.b, run.first + k, 1});
  }
  for (LaneGroup& group : single.groups) group.bound = {0, 0, 0, -1};  // always near
  LaneTree ungrouped = tree;
  ungrouped.groups = single.groups.data();
  ungrouped.runs = single.runs.data();
  ungrouped.run_count = static_cast<int>(single.runs.size());
  int found = 0;
  for (int round = 0; round < kTreeRounds; ++round) {
    std::vector<double> u;
    for (int i = 0; i < kLaneStates * tree.variable_count; ++i) u.push_back(scene.number(-1.5, 1.5));
    LaneClearance query{};
    query.levels = round % 3;
    const LaneOutcome outcome = lane_outcome(lane_kernels(), tree, u, kLaneStates, query, true);
    ASSERT_EQ(outcome, lane_outcome(lane_kernels(), ungrouped, u, kLaneStates, query, true));
    found += outcome.lanes != 0 ? 1 : 0;
  }
  EXPECT_GT(found, 0);
}

TEST(ClearanceLanes, RepeatedCallsOnOneMemoryAreEqual) {
  RandomTree scene;
  const LaneTree tree = scene.tree();
  std::vector<double> u(static_cast<std::size_t>(kLaneStates * tree.variable_count), 0.3);
  LaneClearance query{};
  query.levels = 2;
  EXPECT_EQ(lane_outcome(lane_kernels(), tree, u, 8, query, false),
            lane_outcome(lane_kernels(), tree, u, 8, query, false));
}

}  // namespace
}  // namespace doppel
