// The features that a world needs and an engine lacks, by joint and by key.

#include <fmt/format.h>

#include <algorithm>

#include "doppel/physics/contract/engine_modules.h"

namespace doppel {
namespace {

constexpr std::size_t kNamesShown = 5;

class MissingCapabilities {
 public:
  MissingCapabilities(const EngineCapabilities& engine, Diagnostics& diagnostics)
      : engine_(engine), diagnostics_(diagnostics) {}

  // One warning for all joints of an instance that need what the engine lacks.
  template <typename Needs>
  void joints(const ModelInstance& instance, const Needs& needs, const char* what, const char* instead) {
    std::vector<std::string> names;
    for (const ModelJoint& joint : instance.model->joints) {
      if (needs(joint)) names.push_back(fmt::format("'{}'", joint.name));
    }
    if (names.empty()) return;
    const std::size_t more = names.size() - std::min(names.size(), kNamesShown);
    names.resize(names.size() - more);
    warn(instance,
         fmt::format("{} of {}{}", what, fmt::join(names, ", "),
                     more > 0 ? fmt::format(" and {} more joints", more) : ""),
         instead);
  }

  void warn(const ModelInstance& instance, const std::string& what, const char* instead) {
    diagnostics_.warning(
        "physics.engine_lacks", instance.description->source,
        fmt::format("the engine {} has no {} in '{}': {}", engine_.name, what, instance.name, instead),
        fmt::format("choose another engine, as --engine {}", kDefaultEngine));
  }

 private:
  const EngineCapabilities& engine_;
  Diagnostics& diagnostics_;
};

bool has_stop(const ModelJoint& joint) {
  return joint.scalar() && joint.stop_stiffness > 0 && std::max(joint.lower, -joint.upper) > -kInfinity;
}

}  // namespace

void report_missing_capabilities(const EngineCapabilities& engine, const WorldSettings& settings,
                                 std::span<const ModelInstance> instances, Diagnostics& diagnostics) {
  if (std::ranges::find(engine.integrators, settings.integrator) == engine.integrators.end()) {
    throw InputError("physics.engine_integrator", {},
                     fmt::format("the engine {} does not offer the integrator {}", engine.name,
                                 name_of(settings.integrator)),
                     fmt::format("write integrator: {} in the world file, or choose another engine",
                                 name_of(engine.integrators.front())));
  }
  MissingCapabilities lacks(engine, diagnostics);
  for (const ModelInstance& instance : instances) {
    const bool shaped = std::ranges::any_of(instance.shapes, [](const auto& of) { return !of.empty(); });
    if (!engine.contacts && shaped) lacks.warn(instance, "contacts", "it collides with nothing");
    const bool terrain = std::ranges::any_of(instance.shapes, [](const auto& shapes) {
      return std::ranges::any_of(shapes, [](const CollisionShape& shape) {
        return std::holds_alternative<SharedField>(shape.geometry);
      });
    });
    if (engine.contacts && !engine.heightmaps && terrain)
      lacks.warn(instance, "contacts with heightmaps", "it collides with nothing");
    const bool directed = std::ranges::any_of(instance.shapes, [](const auto& shapes) {
      return std::ranges::any_of(shapes, [](const CollisionShape& shape) {
        return shape.friction.directed() || shape.friction.torsion > 0 || shape.friction.slip > 0;
      });
    });
    if (engine.contacts && !engine.directed_friction && directed)
      lacks.warn(instance, "friction with a direction (fdir1, torsional)",
                 "the smaller coefficient holds in every direction");
    const bool bounces = std::ranges::any_of(instance.shapes, [](const auto& shapes) {
      return std::ranges::any_of(shapes,
                                 [](const CollisionShape& shape) { return shape.restitution.has_value(); });
    });
    if (engine.contacts && !engine.bounce && bounces)
      lacks.warn(instance, "contacts with a restitution", "its impacts are the engine's own");
    if (!engine.mimics)
      lacks.joints(
          instance, [](const ModelJoint& j) { return j.mimics(); }, "<mimic> coupling",
          "they move independently");
    if (!engine.friction)
      lacks.joints(
          instance, [](const ModelJoint& j) { return j.friction > 0; }, "joint friction",
          "they move without friction");
    if (!engine.stops) lacks.joints(instance, has_stop, "<stopStiffness>", "the engine's own stop is used");
    if (!engine.ideal && std::ranges::any_of(instance.servos, &ServoParameters::ideal))
      lacks.warn(instance, "ideal servos", "the servo model with limits is used");
    if (!engine.planar)
      lacks.joints(
          instance, [](const ModelJoint& j) { return j.type == JointType::planar; }, "planar joints",
          "they are fixed");
    if (!engine.floating)
      lacks.joints(
          instance, [](const ModelJoint& j) { return j.type == JointType::floating; }, "floating joints",
          "they are fixed");
  }
}

}  // namespace doppel
