// Fuzz target: load_yaml on any bytes; what the simple reader accepts, the other one reads in the same way.
#include <cstdint>
#include <cstdlib>

#include "doppel/description/xacro/detail/xacro_yaml.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto simple = doppel::xacro::parse_simple_yaml(text);
  try {
    const std::string whole = doppel::xacro::parse_whole_yaml(text, "fuzz.yaml", {}).repr();
    if (simple && simple->repr() != whole) std::abort();
  } catch (const doppel::InputError&) {
    if (simple) std::abort();
  }
  return 0;
}
