// Fuzz target: the data of an octomap, whose first byte chooses its form.
#include <cstdint>
#include <cstdlib>

#include "doppel/robot/scene_objects/octomap.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    const auto cells = doppel::occupied_cells({"OcTree", 0.05, (data[0] & 1) != 0, {data + 1, size - 1}});
    for (const Eigen::AlignedBox3d& cell : *cells) {
      if (!(cell.sizes().minCoeff() > 0.049)) std::abort();
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
