// Fuzz target: an overlay beside a description.
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/overlay/overlay.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(
        doppel::parse_overlay({reinterpret_cast<const char*>(data), size}, "fuzz.overlay.yaml"));
  } catch (const doppel::InputError&) {
  }
  return 0;
}
