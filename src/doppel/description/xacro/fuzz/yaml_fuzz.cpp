// Fuzz target: load_yaml on any bytes.
#include <cstdint>

#include "doppel/description/xacro/detail/xacro_yaml.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    static_cast<void>(doppel::xacro::parse_yaml(text, "fuzz.yaml", {}).repr());
  } catch (const doppel::InputError&) {
  }
  return 0;
}
