#include "doppel/review/conversion/srdf.h"

#include <fmt/format.h>

#include "doppel/description/srdf/srdf.h"
#include "doppel/robot/semantics/derived_srdf.h"

namespace doppel {

std::string to_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                    const std::vector<DisabledPair>& disabled) {
  return to_srdf(model, groups, disabled, {});
}

std::string to_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                    const std::vector<DisabledPair>& disabled, const std::vector<LinkSpheres>& spheres) {
  SrdfDescription srdf = derived_srdf(model, groups, disabled);
  for (const LinkSpheres& cover : spheres) {
    SrdfSpheres out{.link = model.links[static_cast<std::size_t>(cover.link)].name};
    for (const CoverSphere& sphere : cover.spheres) out.spheres.push_back({sphere.centre, sphere.radius});
    srdf.spheres.push_back(std::move(out));
  }
  return write_srdf(srdf);
}

std::vector<LinkSpheres> find_link_spheres(const RobotDescription& robot, const Model& model,
                                           CollisionDetail detail, Diagnostics& diagnostics) {
  const SceneInstance instance = described_robot(robot, model);
  const auto covers = make_covers(
      instance,
      {.detail = detail, .budget = CoverOptions{}.budget, .cache = CoverOptions{}.cache, .still = false});
  std::vector<LinkSpheres> out;
  for (LinkSpheres& cover : link_spheres(instance, *covers, detail)) {
    if (cover.proven) {
      out.push_back(std::move(cover));
      continue;
    }
    const std::string& name = model.links[static_cast<std::size_t>(cover.link)].name;
    const Link* const link = robot.find_link(name);
    diagnostics.warning(
        "convert.cover", link == nullptr ? SourceLocation{} : link->source,
        fmt::format("link '{}' gets no spheres: a cover of its collision shapes was not found, "
                    "or one of them cannot be read",
                    name),
        "see what doppel check reports about its shapes");
  }
  return out;
}

}  // namespace doppel
