// Fuzz target: any request of a client gives a file of the package or a rejection, never a byte from outside
// of it.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "doppel/ros/server/asset_library.h"

namespace {

namespace fs = std::filesystem;

// A package with a mesh, a texture and a link that points outside, next to a file that must not be served.
doppel::AssetLibrary& library() {
  static doppel::AssetLibrary made;
  static const bool filled = [] {
    char name[] = "/tmp/doppel_fuzz_XXXXXX";
    const fs::path folder = mkdtemp(name);
    fs::create_directories(folder / "p/m");
    std::ofstream(folder / "p/package.xml") << "<package><name>p</name></package>";
    std::ofstream(folder / "p/m/a.stl") << "inside";
    std::ofstream(folder / "p/m/t.png") << "inside";
    std::ofstream(folder / "o.png") << "outside";
    fs::create_symlink(folder / "o.png", folder / "p/l.png");
    fs::create_directory_symlink(folder, folder / "p/u");
    doppel::RobotFiles files;
    files.description = folder / "p/arm.urdf";
    files.meshes = {{"package://p/m/a.stl", folder / "p/m/a.stl"}, {"m/a.stl", folder / "p/m/a.stl"}};
    made.offer(files);
    return true;
  }();
  static_cast<void>(filled);
  return made;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto answer = library().read({reinterpret_cast<const char*>(data), size});
  if (answer.bytes == nullptr) return 0;
  const std::string_view text(reinterpret_cast<const char*>(answer.bytes->data()), answer.bytes->size());
  if (text != "inside") std::abort();
  return 0;
}
