// Fuzz target: the results of an earlier validation, with which a run is compared.
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/validation/reports/results.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(doppel::read_results(doppel::fuzz_file("results.json", data, size)));
  } catch (const doppel::InputError&) {
  }
  return 0;
}
