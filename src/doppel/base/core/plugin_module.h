#pragma once
// Libraries that few runs need and that would slow every start (binding their symbols takes milliseconds) are
// wrapped in plugin modules and loaded when they are first requested. Any thread.

#include <stdexcept>
#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// what() names the module, the reason, and what to install or build.
struct DOPPEL_API MissingModule : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// True if lib<name>.so exists in plugin_module_folder().
DOPPEL_API bool plugin_module_exists(const std::string& name);

// A plugin module may be built for several instruction sets of x86-64: `name`, `name`_avx2 and
// `name`_avx512. The names that this processor can run, narrowest registers first. AVX-512 means F, DQ,
// BW and VL.
DOPPEL_API std::vector<std::string> modules_for_processor(const std::string& name);
// The last of them that exists; `name` if none does. A checkout that was just built has only the plain one.
DOPPEL_API std::string widest_module(const std::string& name);

// The address of `symbol` in lib<name>.so, which stays loaded. Throws MissingModule.
DOPPEL_API void* plugin_symbol(const std::string& name, const char* symbol);

}  // namespace doppel
