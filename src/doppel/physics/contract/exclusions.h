#pragma once
// The pairs of bodies that never collide: by the structure of a model (one rigid body, joined by a joint,
// both fixed to the world), and because they touch or overlap at the start. Links that touch at the start do
// so by their shapes, for example a convex hull that fills a hollow, and would push each other forever; a
// body that starts inside the ground or another instance would be thrown.

#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class CollisionScene;

// m: depth up to which a body counts as standing on the ground or beside another one, not inside it.
inline constexpr double kOverlap = 1e-4;

class DOPPEL_API Exclusions {
 public:
  Exclusions(const WorldSettings& settings, std::span<const ModelInstance> instances);
  // Takes over the pairs that an earlier world found at its start, for instances with the same
  // name and model.
  void keep(const CompiledWorld& before);

  // In either order. Pairs without a shape are not listed.
  [[nodiscard]] bool contains(BodyId a, BodyId b) const;
  // Excludes a pair that touches at the start: within one instance every contact, between two instances those
  // deeper than kOverlap, unless both are objects. True: the pair is new, so that an engine that finds a
  // limited number of contacts has to search again.
  bool note(const Contact& contact);
  // In the order of the instances: pairs of one instance, overlaps at the start, pairs fixed to the world. In
  // a pair of a robot and an object or the ground, `a` is the robot's link.
  [[nodiscard]] std::vector<ExcludedPair> list() const;

 private:
  using Key = std::pair<BodyId, BodyId>;  // first < second
  static Key key_of(BodyId a, BodyId b) { return a < b ? Key{a, b} : Key{b, a}; }
  [[nodiscard]] bool fixed(BodyId body) const;
  [[nodiscard]] bool is_object(BodyId body) const;
  void add_fixed(std::vector<ExcludedPair>& out) const;
  struct Entry {
    std::string reason;
    double depth = 0;
    bool at_start = false;  // found by note()
  };
  std::span<const ModelInstance> instances_;
  bool ground_;
  std::vector<std::vector<int>> groups_;  // [instances][links]
  std::map<Key, Entry> pairs_;
};

// The world for distances and collision checks, so that what plans a motion sees what the engine simulates:
// the same bodies under the same BodyId, their shapes, the ground, and the excluded pairs with their reasons.
// Robots and objects are where the world puts them at reset; a CollisionContext starts each in
// Model::neutral().
DOPPEL_API std::shared_ptr<const CollisionScene> make_collision_scene(const CompiledWorld& world);

}  // namespace doppel
