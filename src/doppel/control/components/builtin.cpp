#include "doppel/control/components/builtin.h"

#include "doppel/control/components/loopback.h"
#include "doppel/control/hardware_registry.h"

namespace doppel {

void register_builtin_hardware(HardwareRegistry& registry) {
  registry.add("doppel/Loopback", HardwareKind::real, [] { return std::make_unique<Loopback>(); });
}

}  // namespace doppel
