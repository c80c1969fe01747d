// Fuzz target: every text is read as a material script; colours are within 0 and 1.
#include <cstdint>
#include <cstdlib>

#include "doppel/scenario/sdf/detail/material_script.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const auto& [name, material] :
       doppel::sdf::parse_material_script({reinterpret_cast<const char*>(data), size})) {
    if (material.diffuse &&
        !((material.diffuse->array() >= 0).all() && (material.diffuse->array() <= 1).all()))
      std::abort();
  }
  return 0;
}
