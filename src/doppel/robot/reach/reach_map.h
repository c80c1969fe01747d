#pragma once
// Maps of where an arm's tool can go: for each cell of a grid, in how many directions the tool can point
// there, and how far from singularities and limits the arm is then. Sources: Zacharias, Borst and
// Hirzinger, "Capturing robot workspace structure", IROS 2007; Porges et al., "Reachability and capability
// analysis", 2014.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/reach/arm_reach.h"

namespace doppel {

struct ReachMapOptions {
  double cell = 0;      // m; 0: about forty cells across the reach
  int directions = 50;  // of the tool, spread evenly over the sphere
  bool collisions = true;
  // The only direction of the tool that counts, unit, in the root link; directions is then 1.
  std::optional<Eigen::Vector3d> approach = {};
  Eigen::VectorXd q = {};  // [nq] where the other joints are; empty: neutral
  int threads = 0;         // 0: all of the processor's
  // Called with the completed fraction, 0..1, from one thread at a time; false: cancels. May be empty.
  std::function<bool(double)> progress = {};
};

struct ReachCell {
  bool in_reach = false;  // of the position, whatever the direction
  // The share of the directions, 0..1. For an arm that sets fewer than six numbers of a pose, a direction
  // counts if the tool comes as near to it as the directions are to each other.
  float share = 0;
  float manipulability = 0;  // the largest of the solutions that were found
  float limit_distance = 0;  // the same, limit_distance()
};

struct DOPPEL_API ReachMap {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m, root link: the centre of cell (0, 0, 0)
  double cell = 0;                                   // m
  int nx = 0, ny = 0, nz = 0;
  int directions = 0;
  bool cancelled = false;
  std::vector<ReachCell> cells;  // [nz][ny][nx]

  [[nodiscard]] const ReachCell& at(int x, int y, int z) const {
    return cells[(static_cast<std::size_t>(z) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(y)) *
                     static_cast<std::size_t>(nx) +
                 static_cast<std::size_t>(x)];
  }
  [[nodiscard]] Eigen::Vector3d center(int x, int y, int z) const {
    return origin + cell * Eigen::Vector3d(x, y, z);
  }
};

struct ReachFacts {
  double volume = 0;            // m^3 that can be reached
  double dexterous_volume = 0;  // m^3 with at least nine tenths of the directions
  double farthest = 0;          // m from the first joint's origin
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();  // m, of the cells in reach
  Eigen::Vector3d best = Eigen::Vector3d::Zero();  // m: the cell with the largest share, then manipulability
  double best_share = 0;
};

// The same map for any number of threads. `scene`: as for ArmReach. Throws InputError: the cells are so
// small that the map does not fit into 320 MB ("reach.cells").
DOPPEL_API ReachMap make_reach_map(const std::shared_ptr<const Model>& model, const Chain& chain,
                                   const std::shared_ptr<const CollisionScene>& scene,
                                   const ReachMapOptions& options);

DOPPEL_API ReachFacts reach_facts(const ReachMap& map, const Eigen::Vector3d& first_joint);

}  // namespace doppel
