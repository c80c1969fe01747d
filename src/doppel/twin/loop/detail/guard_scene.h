#pragma once
// The collision shapes of a robot with the keep-out boxes around it, and the pairs that no motion may bring
// together: those that collide in the simulation (exclusions.h), less those whose relative pose depends on
// one joint alone, which its limits bound. Immutable, so that threads can share it.

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "doppel/physics/contract/engine.h"
#include "doppel/physics/contract/keep_out.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {

class GuardScene {
 public:
  GuardScene(const Instance& robot, const std::vector<KeepOutBox>& boxes);

  [[nodiscard]] const Model& model() const { return *model_; }
  [[nodiscard]] const std::shared_ptr<const CollisionScene>& scene() const { return scene_; }
  // Indices of the scene's tested pairs.
  [[nodiscard]] const std::vector<std::size_t>& pairs() const { return pairs_; }
  // "'forearm' would touch 'base'"
  [[nodiscard]] std::string sentence(std::size_t pair, const char* verb) const;

 private:
  void leave_out_single_joints();

  std::shared_ptr<const Model> model_;
  std::shared_ptr<const CollisionScene> scene_;
  std::vector<std::size_t> pairs_;
};

// The joints that move a link, as the leaders that drive them.
std::set<int> drivers_of(const Model& model, int link);

}  // namespace doppel
