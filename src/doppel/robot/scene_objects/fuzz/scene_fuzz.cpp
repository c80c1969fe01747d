// Fuzz target: a .scene file. What is read is written, and reads as the same again.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "doppel/robot/scene_objects/scene_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const std::string first = doppel::write_scene(doppel::parse_scene(text, "fuzz.scene"));
    const doppel::SceneFile again = doppel::parse_scene(first, "written.scene");
    for (const doppel::SceneObject& object : again.objects) {
      if (doppel::scene_instance(object, object.X_PO).shapes.front().empty()) std::abort();
    }
  } catch (const doppel::InputError&) {
  }
  return 0;
}
