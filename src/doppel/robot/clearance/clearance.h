#pragma once
// Proven clearance of one moving instance of a collision scene: states and edges that touch nothing.
//
//   auto scene = std::make_shared<const CollisionScene>(std::vector{robot, table}, triangles);
//   Clearance clearance(scene, {make_covers(robot), make_covers(table, still)}, {});
//   if (clearance.is_free(q0) && clearance.edge(q0, q1).free) ...
//
// A state is free if the spheres of its pairs of bodies are apart, from the coarsest level to the finest.
// Pairs whose spheres touch are decided by the scene (CollisionContext::surfaces_touch): by triangles, or by
// hulls. An edge, the straight line of two states in joint space, is free for every instant: each pair moves
// by no more than its joints' motions times the radii about their axes, so that its distance at one state
// proves a span around it. Spans that are not proven are halved; one in which the pair moves by less than
// `resolution` counts as touching.
//
// Pairs of which neither body moves with the instance are not tested. As for FCL, a mesh that is completely
// inside another one does not touch it; spheres cover the inside of closed meshes, so that it is rarely
// called free without a look at the triangles.

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/clearance/instance_covers.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/lanes/lane_kernels.h"

namespace doppel {

struct ClearanceOptions {
  int moving = 0;                                        // the instance
  double padding = 0;                                    // m, of all its links and of what they hold
  std::vector<std::pair<BodyId, double>> paddings = {};  // m, of single bodies instead
  double resolution = 1e-4;                              // m of motion
  const LaneKernels* kernels = nullptr;                  // nullptr: those of the processor
};

struct StateClearance {
  bool free = true;
  BodyId a, b;            // that touch
  bool by_scene = false;  // the triangles or hulls of a pair were asked
};

struct EdgeClearance {
  bool free = true;
  double parameter = 1;     // 0..1, of the first contact; up to there the edge is free
  BodyId a, b;              // that touch there
  bool resolution = false;  // they are nearer than the resolution, or within padding, and do not touch
  int states = 0;           // that were computed in lanes
  int measured = 0;         // distances of triangles
};

// The memory of one thread. Configurations are q [nq] of the moving instance, rad, m. Its joints with several
// degrees of freedom stay where set_configuration() has put them. Not finite positions are never free.
class DOPPEL_API Clearance {
 public:
  // covers: one for each instance. Throws std::invalid_argument: they are of another number of links, or the
  // moving instance has no model; MissingModule.
  Clearance(std::shared_ptr<const CollisionScene> scene,
            std::vector<std::shared_ptr<const InstanceCovers>> covers, ClearanceOptions options = {});
  ~Clearance();
  Clearance(Clearance&&) noexcept;

  // Places other instances, and of the moving one its root and its joints with several degrees of freedom.
  void set_root(int instance, const Pose& X_WR);
  void set_configuration(int instance, const ConstVector& q);

  [[nodiscard]] StateClearance state(const ConstVector& q);
  [[nodiscard]] bool is_free(const ConstVector& q) { return state(q).free; }
  // states: one in each column.
  void free_states(const Eigen::Ref<const Eigen::MatrixXd>& states, std::span<bool> free);

  // m, not more than the distance of the nearest tested pair with padding, by the spheres of `level` 1 or 2;
  // not more than `far`. Negative: spheres overlap.
  [[nodiscard]] double distance_bound(const ConstVector& q, int level = 2, double far = kFarAway);
  // m: the distance itself, by the scene's hulls and primitives, without padding.
  [[nodiscard]] PairDistance distance(const ConstVector& q, double far = kFarAway);

  // first: false ends with any contact, which is faster.
  [[nodiscard]] EdgeClearance edge(const ConstVector& q0, const ConstVector& q1, bool first = true);

  // The lanes alone, for measurements: up to 16 states, with a bit for each that spheres of `level` do not
  // prove free.
  [[nodiscard]] std::uint32_t touching_spheres(const Eigen::Ref<const Eigen::MatrixXd>& states, int level,
                                               bool until_decided);
  [[nodiscard]] std::size_t sphere_count(int level) const;  // of all bodies that move
  [[nodiscard]] std::size_t pair_count() const;             // with something that moves

  struct Impl;  // of this module

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
