#pragma once
// Text of others, for a terminal.

#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// With '?' for each control character that could steer the terminal (all but the line's end) and for each
// byte that is not valid UTF-8.
DOPPEL_API std::string printable(std::string_view text);

}  // namespace doppel
