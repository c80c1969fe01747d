#pragma once
// A scene as the lanes of a kernel take it, in the frame of the moving instance's root, and the bounds of
// motion.

#include <span>
#include <vector>

#include "doppel/robot/clearance/clearance.h"
#include "doppel/robot/clearance/instance_covers.h"
#include "doppel/robot/lanes/lane_kernels.h"

namespace doppel {

// The places of the instances.
struct ScenePlaces {
  std::vector<Pose> X_WR;               // [instances]
  std::vector<Eigen::VectorXd> q;       // [instances]; of an object empty
  std::vector<std::vector<Pose>> X_RL;  // [instances][links], links in their instance's root
};

class LaneScene {
 public:
  LaneScene(const CollisionScene& scene, std::span<const std::shared_ptr<const InstanceCovers>> covers,
            const ClearanceOptions& options, const ScenePlaces& places);

  struct Body {
    BodyId id;
    int joint = -1;                                   // in the tree; -1: it stands still
    Pose X_ZB = Pose::Identity();                     // in the Z of its joint, or in the root
    const std::vector<ShapeCover>* shapes = nullptr;  // nullptr: the ground
    double radius = 0;                                // m: the farthest point from the axis of its joint
    double reach = 0;                                 // m: and from the origin of its Z
    double padding = 0;                               // m
  };
  struct Pair {
    int a = 0, b = 0;      // bodies; a moves
    BodyId first, second;  // as in the scene
  };

  [[nodiscard]] LaneTree tree() const;
  [[nodiscard]] const std::vector<Body>& bodies() const { return bodies_; }
  [[nodiscard]] const std::vector<Pair>& pairs() const { return pairs_; }
  [[nodiscard]] const std::vector<float>& paddings() const { return paddings_; }
  [[nodiscard]] int variable_count() const { return static_cast<int>(variables_.size()); }
  [[nodiscard]] std::size_t sphere_count(int level) const;
  [[nodiscard]] const std::vector<CoverSphere>& spheres(int body, int level) const {
    return spheres_[static_cast<std::size_t>(body)][static_cast<std::size_t>(level)];
  }
  [[nodiscard]] std::span<const LaneSolid> solids(int body) const;

  // The variables of the tree from q [nq].
  void variables_of(const ConstVector& q, double* u) const;
  // False where the margin of the kernel does not hold, or for a value that is not finite.
  [[nodiscard]] bool in_range(std::span<const double> u) const;
  // X_KZ of the joints.
  void place(std::span<const double> u, std::vector<Pose>& X_KZ) const;
  [[nodiscard]] Pose pose_of(int body, const std::vector<Pose>& X_KZ) const;
  // [pairs] m that each pair moves at most, of one body in the other, along the straight line from u0 to u1.
  void motion(std::span<const double> u0, std::span<const double> u1, std::vector<double>& per_pair) const;

 private:
  struct Root {  // of an instance or body: where it hangs
    int joint = -1;
    Pose X_ZB = Pose::Identity();
  };
  void add_joints(const Model& model, const Eigen::VectorXd& q);
  [[nodiscard]] Root root_of(int instance) const;
  [[nodiscard]] Root body_root(BodyId id) const;
  void add_body(BodyId id, const ClearanceOptions& options);
  [[nodiscard]] int depth_of(int joint) const;  // joints up to the root
  void add_spheres(LaneBody& lane, const Body& body);
  void add_solids(LaneBody& lane, const Body& body);
  void add_solid(const CollisionShape& shape, const Pose& X_KS);
  void measure(Body& body, int index);
  void measure_reach();
  void add_pairs(const CollisionScene& scene);

  const CollisionScene& scene_;
  std::span<const std::shared_ptr<const InstanceCovers>> covers_;
  const ScenePlaces& places_;  // of the constructor
  int moving_ = 0;
  std::vector<int> variables_;  // index in q
  std::vector<double> travel_;  // [joints] m: a prismatic one goes no farther from its zero
  std::vector<LaneTreeJoint> joints_;
  std::vector<Root> links_;  // of the moving instance
  std::vector<Body> bodies_;
  std::vector<std::array<std::vector<CoverSphere>, 3>> spheres_;  // [bodies] in the Z of their joint
  double extent_ = 0;  // m: no point of what moves is farther from the root
  std::vector<LaneBody> lane_bodies_;
  std::vector<LaneSphere> lane_spheres_;
  std::vector<LaneSolid> lane_solids_;
  std::vector<LanePair> lane_pairs_;
  LaneRuns runs_;
  std::vector<Pair> pairs_;
  std::vector<float> paddings_;
};

}  // namespace doppel
