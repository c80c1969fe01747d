// Fuzz target: the text that a client sends to /spawn_entity. Everything that is accepted has finite size and
// mass.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "doppel/twin/services/detail/entity_xml.h"
#include "doppel/twin/spawn/entity_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const doppel::PackageResolver resolver;
  static const doppel::Target target{"/nonexistent/urdf/robot.urdf", "/nonexistent"};
  const auto find_mesh = [](const std::string& uri) {
    if (uri.starts_with("package://")) return std::filesystem::path("/nonexistent/part.stl");
    return doppel::find_entity_mesh(uri, resolver, target);
  };
  try {
    doppel::Diagnostics notes;
    const doppel::EntityText entity =
        doppel::read_entity_xml({reinterpret_cast<const char*>(data), size}, find_mesh, notes);
    for (const doppel::ModelInstance& made :
         doppel::instances_of(entity, "entity", doppel::Pose::Identity(), notes)) {
      if (!std::isfinite(made.model->total_mass) || !made.X_WR.matrix().allFinite() || !made.q0.allFinite())
        std::abort();
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
