// Fuzz target: the first byte selects the format, the rest is the file. Meshes that are read have only valid
// indices and finite corners.
#include <cstdint>
#include <cstdlib>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/meshes/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kFormats[] = {"stl", "obj", "dae"};
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data + 1), size - 1);
  try {
    const doppel::TriangleMesh mesh =
        doppel::parse_mesh(bytes, kFormats[data[0] % 3], "/nowhere/part", Eigen::Vector3d(1, 1, -1));
    for (const auto& triangle : mesh.triangles) {
      for (const auto corner : triangle) {
        if (corner >= mesh.vertices.size() || !mesh.vertices[corner].allFinite()) std::abort();
      }
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
