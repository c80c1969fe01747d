#pragma once
// The covers of the bodies of a scene's instance. Those of mesh files are kept in the cache of meshes
// (mesh_cache.h), by the file's fingerprint, its scale and the number of spheres, those of other shapes by a
// hash of their corners.

#include <memory>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/clearance/sphere_cover.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {

// The triangles of a shape for distances; read when they are needed first. Any thread.
class DOPPEL_API ShapeSurface {
 public:
  struct Source;
  explicit ShapeSurface(std::unique_ptr<Source> source);
  ~ShapeSurface();
  ShapeSurface(const ShapeSurface&) = delete;
  ShapeSurface& operator=(const ShapeSurface&) = delete;

  // m between two surfaces if it is less than `far`, else `far`; X_AB: that of `other` in the frame of this
  // one. A distance that is not more than `enough` need not be the least one. A mesh that can no longer be
  // read is at distance 0 from everything.
  [[nodiscard]] double distance(const ShapeSurface& other, const Pose& X_AB, double far, double enough) const;

 private:
  std::unique_ptr<Source> source_;
};

struct ShapeCover {
  SphereCover cover;                      // in the shape's frame
  Pose X_LG = Pose::Identity();           // of that frame in the link
  std::optional<CollisionShape> formula;  // a box, cylinder, capsule, sphere, or a terrain's bounds as a box
  std::shared_ptr<const ShapeSurface> surface;
};

using InstanceCovers = std::vector<std::vector<ShapeCover>>;  // [links][shapes]

struct CoverOptions {
  CollisionDetail detail = CollisionDetail::triangles;  // that of the scene
  CoverBudget budget{60, 400};                          // of all shapes together; each gets one at least
  bool cache = true;
  // The shapes stand still: those with a formula need no spheres. For objects that nothing holds.
  bool still = false;
};

// `instance` is as the scene will get it, with its description. Throws InputError: a mesh cannot be read.
[[nodiscard]] DOPPEL_API std::shared_ptr<const InstanceCovers> make_covers(const SceneInstance& instance,
                                                                           const CoverOptions& options = {});

// The geometry that a link's cover has to contain, in its frame: for covers().
[[nodiscard]] DOPPEL_API std::vector<PlacedGeometry> link_geometry(
    const SceneInstance& instance, int link, CollisionDetail detail = CollisionDetail::triangles);

}  // namespace doppel
