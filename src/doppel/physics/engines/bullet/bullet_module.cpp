// The exports of the module.

#include <fmt/format.h>

#include "doppel/physics/contract/engine_modules.h"
#include "doppel/physics/engines/bullet/bullet_engine.h"

namespace doppel {
namespace {

EngineCapabilities capabilities_of_bullet() {
  EngineCapabilities out;
  out.name = "bullet";
  out.version = fmt::format("{}.{}", btGetVersion() / 100, btGetVersion() % 100);
  out.contacts = out.rays = out.floating = out.planar = true;
  out.mimics = out.friction = out.stops = out.ideal = out.bounce = true;
  out.integrators = {Integrator::euler};
  // Measured values with a margin. Bodies at rest penetrate by 0.01 mm, so that they stay in contact.
  out.tolerances = {.period = 3e-6,
                    .free_fall = 1e-12,
                    .holding = 1e-11,
                    .sag = 1e-11,
                    .stiction = 1e-9,
                    .mimic = 1e-9,
                    .penetration = 3e-5};
  return out;
}

std::shared_ptr<const CompiledWorld> compile(WorldSettings settings, std::vector<ModelInstance> instances,
                                             Diagnostics&) {
  return std::make_shared<const BulletWorld>(std::move(settings), std::move(instances), nullptr);
}

const EngineModule kModule{capabilities_of_bullet(), &compile};

}  // namespace

const EngineCapabilities& BulletWorld::capabilities() const {
  return kModule.capabilities;
}

std::unique_ptr<Engine> BulletWorld::make_engine() const {
  return std::make_unique<BulletEngine>(std::static_pointer_cast<const BulletWorld>(shared_from_this()));
}

}  // namespace doppel

DOPPEL_EXPORT_ENGINE(doppel::kModule)
