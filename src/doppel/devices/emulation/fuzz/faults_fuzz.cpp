// Fuzz target: a file of faults. The values of each fault are numbers that a device can have.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/devices/emulation/fault_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    for (const auto& fault : doppel::read_fault_file(doppel::fuzz_file("faults.yaml", data, size), {})) {
      if (!(fault.share >= 0 && fault.share <= 1) || !std::isfinite(fault.amount)) std::abort();
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
