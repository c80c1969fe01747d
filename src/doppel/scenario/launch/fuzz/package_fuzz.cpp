// Fuzz target: CMakeLists.txt and package.xml of a package whose installed layout is shown.
#include <cstdint>
#include <cstdlib>

#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/scenario/launch/detail/installed_view.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace fs = std::filesystem;
  const fs::path package = doppel::fuzz_file("CMakeLists.txt", data, size).parent_path();
  static_cast<void>(doppel::fuzz_file("package.xml", data, size));
  static const bool has_folder = fs::create_directories(package / "urdf/parts");
  static_cast<void>(has_folder);
  const fs::path folder = package.parent_path() / (package.filename().string() + "_view");
  const std::string name = doppel::package_name(package);
  const fs::path view = doppel::installed_view(package, name, folder);
  // The view stays in its folder.
  if (!view.empty() && view.lexically_relative(folder).string().starts_with("..")) std::abort();
  fs::remove_all(folder);
  return 0;
}
