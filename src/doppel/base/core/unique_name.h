#pragma once
// Names in documents whose rules are stricter than URDF's.

#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// `preferred`, or with _2, _3 ... behind it where it is taken; the result is added to `taken`.
DOPPEL_API std::string unique_name(const std::string& preferred, std::vector<std::string>& taken);

}  // namespace doppel
