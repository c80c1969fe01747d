#include "doppel/control/detail/components/builtin.h"

#include "doppel/control/detail/components/loopback.h"
#include "doppel/control/hardware_registry.h"

namespace doppel {

void register_builtin_hardware(HardwareRegistry& registry) {
  registry.add("doppel/Loopback", HardwareKind::real, [] { return std::make_unique<Loopback>(); });
}

}  // namespace doppel
