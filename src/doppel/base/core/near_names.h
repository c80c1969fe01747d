#pragma once
// Suggestions from a list that is too long to be printed.

#include <span>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// Like did_you_mean(); where no name is near, the three nearest ones: "; the nearest are 'a', 'b', 'c'".
DOPPEL_API std::string names_near(std::string_view name, std::span<const std::string> candidates);

}  // namespace doppel
