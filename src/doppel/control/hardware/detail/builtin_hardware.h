#pragma once

namespace doppel {

class HardwareRegistry;
void register_builtin_hardware(HardwareRegistry& registry);

}  // namespace doppel
