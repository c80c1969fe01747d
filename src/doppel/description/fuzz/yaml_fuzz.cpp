// Fuzz target: what load_yaml makes of any bytes.
#include <cstdint>

#include "doppel/description/xacro_detail.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    doppel::xacro::parse_yaml(std::string(reinterpret_cast<const char*>(data), size), "fuzz.yaml", {}).repr();
  } catch (const doppel::InputError&) {
    return 0;
  }
  return 0;
}
