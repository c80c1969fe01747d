// Fuzz target: the plan of a motion, as a person may have edited it.
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/review/identification/motion_plan.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(doppel::to_yaml(doppel::read_motion_plan(doppel::fuzz_file("plan.yaml", data, size))));
  } catch (const doppel::InputError&) {
  }
  return 0;
}
