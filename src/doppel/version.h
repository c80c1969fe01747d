#pragma once
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// Of the library that runs, "0.1.0".
DOPPEL_API std::string_view version();

}  // namespace doppel
