// Fuzz target: the suite of a validation.
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/validation/checks/suite.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(doppel::load_suite(doppel::fuzz_file("suite.yaml", data, size)));
  } catch (const doppel::InputError&) {
  }
  return 0;
}
