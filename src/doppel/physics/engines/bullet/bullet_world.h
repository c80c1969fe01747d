#pragma once
// The compiled world of Bullet: the instances as articulated bodies, their shapes, and the pairs of shapes
// that may touch.

#include <memory>
#include <vector>

#include "doppel/physics/contract/detail/drive.h"
#include "doppel/physics/contract/detail/joint_springs.h"
#include "doppel/physics/contract/exclusions.h"
#include "doppel/physics/engines/bullet/articulation.h"
#include "doppel/physics/engines/bullet/contact_finder.h"

namespace doppel {

// One instance compiled.
struct BulletInstance {
  Articulation articulation;
  std::vector<Drive> drives;
  std::vector<JointSpring> springs;  // of the drives, in their order, then of the limit stops
  std::vector<int> drive_of_joint;   // [joints]; -1: none
  std::vector<double> damping;       // [nv] of the joints
};

class BulletWorld final : public CompiledWorld {
 public:
  // `before`: the world whose exclusions are kept, or nullptr.
  BulletWorld(WorldSettings settings, std::vector<ModelInstance> instances, const BulletWorld* before);

  [[nodiscard]] const EngineCapabilities& capabilities() const override;
  [[nodiscard]] std::unique_ptr<Engine> make_engine() const override;
  [[nodiscard]] std::shared_ptr<const CompiledWorld> with(std::vector<ModelInstance> instances,
                                                          Diagnostics& diagnostics) const override;

  [[nodiscard]] const std::vector<BulletInstance>& compiled() const { return compiled_; }
  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }
  [[nodiscard]] const std::vector<PiecePair>& pairs() const { return pairs_; }
  [[nodiscard]] BodyId link_of(int piece) const {
    return piece < 0 ? BodyId{} : pieces_[static_cast<std::size_t>(piece)].link;
  }

 private:
  void collect_pieces();
  void list_pairs(const Exclusions& exclusions);
  void note_start(Exclusions& exclusions, const BulletWorld* before);
  [[nodiscard]] bool is_new(BodyId body, const BulletWorld& before) const;

  std::vector<BulletInstance> compiled_;
  std::vector<Piece> pieces_;
  std::vector<PiecePair> pairs_;
};

}  // namespace doppel
