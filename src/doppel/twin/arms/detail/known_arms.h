#pragma once
// The arms of a robot with their solvers and collision scenes, made when they are first asked for and kept
// until the robot or its world changes. The worker's thread.

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/robot/reach/arm_group.h"
#include "doppel/robot/reach/arm_reach.h"
#include "doppel/twin/arms/arm_snapshot.h"

namespace doppel {

class KnownArms {
 public:
  // Forgets what belongs to another robot or world, and places the surroundings.
  void show(const ArmSnapshot& snapshot);

  // The groups of the robot's semantic description (SRDF) if there is one, and those that are found.
  [[nodiscard]] const std::vector<ArmGroup>& groups() const { return groups_; }
  // The solver of a group; with another tip, of the chain from the group's base to it; with a tip and no
  // group, of the tip's group. Throws InputError: there is
  // no such group ("reach.unknown_group") or link ("reach.unknown_link"), or no chain ("reach.no_chain").
  ArmReach& arm(const std::string& group, const std::string& tip);
  [[nodiscard]] const ArmGroup& group(const std::string& name) const { return choose_arm(groups_, name); }
  // The name of the group that arm() takes; empty: the tip is of none.
  [[nodiscard]] std::string name_of_group(const std::string& group, const std::string& tip) const;
  // All pairs, also those that no arm moves.
  CollisionContext& everything();
  [[nodiscard]] std::shared_ptr<const CollisionScene> scene_of(const std::string& group);

 private:
  [[nodiscard]] ReachSurroundings surroundings() const;
  void add_world(ReachSurroundings& out) const;
  [[nodiscard]] Pose X_RO(const SceneObject& object) const;
  void place(CollisionContext& context) const;
  void find_groups();
  [[nodiscard]] int link_named(const std::string& name) const;
  [[nodiscard]] Chain chain_to(int base_link, int tip_link) const;
  [[nodiscard]] const ArmGroup* group_of_link(int link) const;

  struct Entry {
    std::shared_ptr<const CollisionScene> scene;
    std::unique_ptr<ArmReach> reach;
  };

  ArmSnapshot now_;
  std::vector<ArmGroup> groups_;
  std::map<std::pair<int, int>, Entry> arms_;  // by the links at the ends of the chain
  std::unique_ptr<CollisionContext> everything_;
};

}  // namespace doppel
