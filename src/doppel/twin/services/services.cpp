#include "doppel/twin/services/services.h"

#include "doppel/twin/services/detail/entity_services.h"
#include "doppel/twin/services/detail/simulator_services.h"
#include "doppel/twin/services/detail/world_services.h"

namespace doppel {

void add_services(TwinCore& core) {
  auto simulator = std::make_unique<SimulatorServices>(core);
  auto entities = std::make_unique<EntityServices>(core);
  auto world = std::make_unique<WorldServices>(core, *entities, *simulator);
  core.add(std::move(simulator));
  core.add(std::move(world));
  core.add(std::move(entities));
}

}  // namespace doppel
