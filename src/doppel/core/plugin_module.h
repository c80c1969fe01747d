#pragma once
// Libraries that few runs need and every start would pay for (their symbols take milliseconds to bind) are
// wrapped in modules beside the program and loaded when they are first requested.

#include <string>

#include "doppel/export.h"

namespace doppel {

// Whether lib<name>.so is there.
DOPPEL_API bool plugin_module_exists(const std::string& name);

// The address of `symbol` in lib<name>.so, which stays loaded. Throws std::runtime_error with the reason.
DOPPEL_API void* plugin_symbol(const std::string& name, const char* symbol);

}  // namespace doppel
