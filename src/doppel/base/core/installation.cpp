#include "doppel/base/core/installation.h"

#include <dlfcn.h>
#include <link.h>

#include <cstdlib>
#include <string>

namespace doppel {
namespace {

namespace fs = std::filesystem;

// The file that contains this code. The dynamic loader reports no name for the program itself.
fs::path own_file() {
  std::error_code none;
  Dl_info info{};
  link_map* object = nullptr;
  if (dladdr1(reinterpret_cast<const void*>(&own_file), &info, reinterpret_cast<void**>(&object),
              RTLD_DL_LINKMAP) != 0 &&
      object != nullptr && object->l_name != nullptr && *object->l_name != '\0')
    return fs::canonical(object->l_name, none);
  return fs::read_symlink("/proc/self/exe", none);
}

fs::path own_folder() {
  static const fs::path folder = own_file().parent_path();
  return folder;
}

std::string root_of_environment() {
  const char* root = std::getenv("DOPPEL_ROOT");
  return root == nullptr ? "" : root;
}

bool is_folder(const fs::path& path) {
  std::error_code none;
  return fs::is_directory(path, none);
}

fs::path find_data_folder() {
  for (fs::path above = own_folder(); above.has_relative_path(); above = above.parent_path()) {
    if (is_folder(above / "share/doppel/robots")) return above / "share/doppel";
    if (is_folder(above / "robots") && is_folder(above / "src/doppel")) return above;
  }
  return {};
}

}  // namespace

fs::path data_folder() {
  if (std::string root = root_of_environment(); !root.empty()) return root;
  static const fs::path found = find_data_folder();
  return found;
}

fs::path page_folder() {
  const fs::path data = data_folder();
  return is_folder(data / "page") ? data / "page" : data / "web/dist";
}

fs::path plugin_module_folder() {
  if (const std::string root = root_of_environment();
      !root.empty() && is_folder(fs::path(root) / "lib/doppel"))
    return fs::path(root) / "lib/doppel";
  const fs::path beside = own_folder() / "doppel";
  return is_folder(beside) ? beside : own_folder().parent_path() / "lib/doppel";
}

}  // namespace doppel
