// Fuzz target: SDF text is read or refused; what is read has finite poses and compiles.
#include <cstdint>
#include <cstdlib>

#include "doppel/scenario/sdf/sdf_world.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    doppel::PackageResolver resolver;
    doppel::Diagnostics found;
    const doppel::SdfWorld world =
        doppel::parse_sdf({reinterpret_cast<const char*>(data), size}, "fuzz.sdf", {}, resolver, found);
    for (const doppel::SdfModel& model : world.models) {
      if (!model.X_WR.matrix().allFinite()) std::abort();
      doppel::compile_model(*model.description, model.base, found);
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
