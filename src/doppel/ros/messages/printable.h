#pragma once
// Text from the network, for a terminal.

#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// Replaces each control character, except the end of a line, and each byte that is not valid UTF-8 by '?',
// because control characters could change the terminal.
DOPPEL_API std::string printable(std::string_view text);
// A name that shows as it is: valid UTF-8 without control characters, and not blank.
DOPPEL_API bool is_printable_name(std::string_view name);

}  // namespace doppel
