#pragma once
// Private to the MuJoCo back end: one compiled model with its data, and where the robot's and the objects'
// parts stand in MuJoCo's arrays.

#include <string>
#include <vector>

#include "doppel/physics/mujoco/compiled_detail.h"
#include "doppel/physics/mujoco/mjcf.h"

namespace doppel {

struct MujocoObject {
  int body = -1;
  int q = -1, v = -1;  // of the free joint; -1: fixed
};

class MujocoState {
 public:
  // Throws InputError in the user's terms where MuJoCo refuses.
  MujocoState(const RobotMjcf& robot, const Model& model, const World& world, CollisionMeshes& meshes,
              Diagnostics& diagnostics);

  mjModel* m() const { return model_.get(); }
  mjData* d() const { return data_.get(); }
  [[nodiscard]] int body_of_link(int link) const { return link_bodies_[link]; }
  [[nodiscard]] int link_of_body(int body) const { return body_links_[body]; }      // -1: none
  [[nodiscard]] int object_of_body(int body) const { return body_objects_[body]; }  // -1: none
  [[nodiscard]] const MujocoObject& object(std::size_t index) const { return objects_[index]; }

  // Lets exactly the pairs with a reason, and the overlaps with what is there, pass through each other. Needs
  // no new compilation.
  void apply_exclusions(const std::vector<LinkPair>& pairs, const std::vector<Overlap>& overlaps);

  // Model's q and v at the head of MuJoCo's arrays, quaternions in MuJoCo's order.
  void write_q(const Model& model, const double* q);
  void read_q(const Model& model, double* q) const;
  void place_object(std::size_t index, const Pose& X_WO);

  // Everything that depends on positions and velocities only. False: MuJoCo gave up.
  bool refresh();

 private:
  void check_order(const Model& model) const;
  // Whether MuJoCo looks at a list of pairs (mjcf.h, kMostListedPairs) or for pairs by itself.
  [[nodiscard]] bool lists_pairs() const;
  void find_exclusions(const RobotMjcf& robot, const World& world);
  [[nodiscard]] bool passes_through(int pair, const std::vector<LinkPair>& pairs,
                                    const std::vector<Overlap>& overlaps) const;

  ModelHandle model_;
  DataHandle data_;
  std::vector<int> link_bodies_, body_links_, body_objects_;
  std::vector<MujocoObject> objects_;
  std::vector<std::string> object_names_;
  struct Surrounding {
    int link;
    std::string object;  // "ground" or the object's name
    int signature;
  };
  std::vector<int> exclusion_signatures_;  // [pairs]
  std::vector<Surrounding>
      surroundings_;  // every movable link with a shape, with the ground and every object
};

}  // namespace doppel
