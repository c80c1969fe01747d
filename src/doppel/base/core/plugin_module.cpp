#include "doppel/base/core/plugin_module.h"

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>

#include "doppel/base/core/installation.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

fs::path path_of(const std::string& name) {
  return plugin_module_folder() / ("lib" + name + ".so");
}

}  // namespace

bool plugin_module_exists(const std::string& name) {
  std::error_code none;
  return fs::exists(path_of(name), none);
}

void* plugin_symbol(const std::string& name, const char* symbol) {
  void* const library = dlopen(path_of(name).c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = library == nullptr ? nullptr : dlsym(library, symbol);
  if (found == nullptr) throw std::runtime_error(std::string("a module of doppel is missing: ") + dlerror());
  return found;
}

}  // namespace doppel
