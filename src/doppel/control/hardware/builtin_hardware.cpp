#include "doppel/control/hardware/detail/builtin_hardware.h"

#include "doppel/control/hardware/detail/loopback.h"
#include "doppel/control/hardware/hardware_registry.h"

namespace doppel {

void register_builtin_hardware(HardwareRegistry& registry) {
  registry.add("doppel/Loopback", HardwareKind::real, [] { return std::make_unique<Loopback>(); });
}

}  // namespace doppel
