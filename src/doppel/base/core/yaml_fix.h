#pragma once
// The fix of a text that yaml-cpp cannot read, by the reader's own words.

#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// "close the '[' before this place" for "end of sequence flow not found".
DOPPEL_API std::string yaml_fix(std::string_view problem);

}  // namespace doppel
