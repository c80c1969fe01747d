#include "doppel/core/late_library.h"

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>

namespace doppel {

void* late_symbol(const std::string& name, const char* symbol) {
  namespace fs = std::filesystem;
  const std::string file = "lib" + name + ".so";
  std::error_code none;
  const fs::path beside = fs::read_symlink("/proc/self/exe", none).parent_path() / file;
  const fs::path path = fs::exists(beside, none) ? beside : fs::path(DOPPEL_LATE_FOLDER) / file;
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = library == nullptr ? nullptr : dlsym(library, symbol);
  if (found == nullptr) throw std::runtime_error(std::string("a part of doppel is missing: ") + dlerror());
  return found;
}

}  // namespace doppel
