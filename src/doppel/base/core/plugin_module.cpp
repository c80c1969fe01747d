#include "doppel/base/core/plugin_module.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "doppel/base/core/installation.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// Modules that a build may leave out; the names of all variants of a module begin alike.
struct OptionalModule {
  std::string_view name, option, package;
};
constexpr OptionalModule kOptional[] = {{"doppel_assimp", "DOPPEL_WITH_ASSIMP", "libassimp-dev"},
                                        {"doppel_embree", "DOPPEL_WITH_EMBREE", "libembree-dev"},
                                        {"doppel_fastdds", "DOPPEL_WITH_ROS2", "libfastrtps-dev"},
                                        {"doppel_fcl", "DOPPEL_WITH_FCL", "libfcl-dev"}};

fs::path path_of(const std::string& name) {
  return plugin_module_folder() / ("lib" + name + ".so");
}

std::string why_unusable(const std::string& name, const char* reason) {
  if (plugin_module_exists(name))
    return fmt::format("the module {} cannot be used: {}; install the library that it names", name, reason);
  const auto left_out = std::ranges::find_if(
      kOptional, [&](const OptionalModule& module) { return name.starts_with(module.name); });
  if (left_out == std::end(kOptional))
    return fmt::format(
        "the module {} is missing; install doppel as a whole, or build it as a whole: tools/build doppel",
        path_of(name).string());
  return fmt::format(
      "doppel was built without the module {}; install {}, configure with -D{}=ON and build again", name,
      left_out->package, left_out->option);
}

}  // namespace

bool plugin_module_exists(const std::string& name) {
  std::error_code none;
  return fs::exists(path_of(name), none);
}

std::vector<std::string> modules_for_processor(const std::string& name) {
  std::vector<std::string> out{name};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) out.push_back(name + "_avx2");
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl"))
    out.push_back(name + "_avx512");
#endif
  return out;
}

std::string widest_module(const std::string& name) {
  const std::vector<std::string> modules = modules_for_processor(name);
  const auto widest = std::find_if(modules.rbegin(), modules.rend(), plugin_module_exists);
  return widest == modules.rend() ? name : *widest;
}

void* plugin_symbol(const std::string& name, const char* symbol) {
  void* const library = dlopen(path_of(name).c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = library == nullptr ? nullptr : dlsym(library, symbol);
  if (found == nullptr) throw MissingModule(why_unusable(name, dlerror()));
  return found;
}

}  // namespace doppel
