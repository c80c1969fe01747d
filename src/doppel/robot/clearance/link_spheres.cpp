#include "doppel/robot/clearance/link_spheres.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace doppel {
namespace {

// A sphere around this one whose numbers are whole steps.
CoverSphere written(const CoverSphere& sphere) {
  constexpr double kSteps = 1 / kWrittenStep;
  CoverSphere out;
  out.centre = sphere.centre.unaryExpr([](double x) { return std::round(x * kSteps) / kSteps + 0.0; });
  const double moved = (out.centre - sphere.centre).norm();
  out.radius = std::ceil((sphere.radius + moved) * kSteps) / kSteps;
  return out;
}

// Shapes of the description that the instance does not have, as one whose file cannot be read.
std::size_t lost_shapes(const SceneInstance& instance, std::size_t link) {
  if (instance.description == nullptr || instance.model == nullptr) return 0;
  const Link* const source = instance.description->find_link(instance.model->links[link].name);
  if (source == nullptr) return 0;
  std::set<int> present;
  for (const CollisionShape& shape : instance.shapes[link]) present.insert(shape.id.collision);
  return source->collisions.size() - present.size();
}

}  // namespace

std::vector<LinkSpheres> link_spheres(const SceneInstance& instance, const InstanceCovers& covers,
                                      CollisionDetail detail) {
  std::vector<LinkSpheres> out;
  for (std::size_t link = 0; link < covers.size(); ++link) {
    const std::size_t lost = lost_shapes(instance, link);
    if (covers[link].empty() && lost == 0) continue;
    LinkSpheres one{static_cast<int>(link), {}, 0, false};
    for (const ShapeCover& shape : covers[link]) {
      for (const CoverSphere& sphere : shape.cover.levels[1])
        one.spheres.push_back(written({shape.X_LG * sphere.centre, sphere.radius}));
      one.excess = std::max(one.excess, shape.cover.excess[1]);
    }
    one.proven = lost == 0 && doppel::covers(one.spheres, link_geometry(instance, one.link, detail));
    out.push_back(std::move(one));
  }
  return out;
}

}  // namespace doppel
