#pragma once
// The memory of a Clearance, shared by its states and edges.

#include "doppel/robot/clearance/clearance.h"
#include "doppel/robot/clearance/detail/lane_scene.h"

namespace doppel {

struct Clearance::Impl {
  Impl(std::shared_ptr<const CollisionScene> the_scene,
       std::vector<std::shared_ptr<const InstanceCovers>> the_covers, ClearanceOptions the_options);

  void rebuild();
  [[nodiscard]] const LaneScene::Pair& pair(std::size_t index) const { return lanes->pairs()[index]; }
  // Tests up to 16 states in `u`; rates, spans: of LaneClearance.
  std::uint32_t run(int count, int levels, bool until_decided, bool moving);
  // True if the scene calls a pair touching, or it is within its padding, at the configuration of the context
  // and the poses of `X_KZ`.
  [[nodiscard]] bool touches(std::size_t index);
  // m between the surfaces of a pair, at the poses of `X_KZ`; `far` and `enough` as of ShapeSurface.
  [[nodiscard]] double gap(std::size_t index, double far, double enough) const;
  [[nodiscard]] double padding(std::size_t index) const;
  [[nodiscard]] bool described(BodyId body) const;
  void place(std::span<const double> positions, const ConstVector& q);
  [[nodiscard]] double bound_of(std::size_t index, int level, double far) const;
  [[nodiscard]] int variables() const { return lanes->variable_count(); }

  std::shared_ptr<const CollisionScene> scene;
  std::vector<std::shared_ptr<const InstanceCovers>> covers;
  ClearanceOptions options;
  const LaneKernels* kernels;
  CollisionContext context;
  ScenePlaces places;
  std::unique_ptr<const LaneScene> lanes;
  LaneTree tree{};
  std::vector<std::byte> memory;
  void* aligned = nullptr;
  std::shared_ptr<const ShapeSurface> ground;  // a slab

  std::vector<double> u;                // [16][variables]
  std::vector<std::uint32_t> touching;  // [pairs]
  std::vector<float> rates, spans;      // [pairs], [16]
  std::vector<Pose> X_KZ;               // [joints]
  std::vector<double> motion;           // [pairs] m, of an edge
  std::vector<char> solid;              // [pairs] of an edge: the scene was asked
};

}  // namespace doppel
