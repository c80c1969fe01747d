// Fuzz target: a datasheet of an actuator, and of the drives of an arm.
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/review/audit/detail/datasheet.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(doppel::load_datasheet(doppel::fuzz_file("sheet.yaml", data, size), "/nowhere"));
  } catch (const doppel::InputError&) {
  }
  return 0;
}
