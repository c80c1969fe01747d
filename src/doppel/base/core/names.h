#pragma once
// "Did you mean": the nearest of a set of valid names.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// Edit distance with adjacent transpositions (Damerau-Levenshtein, optimal
// string alignment), case-insensitive.
DOPPEL_API std::size_t edit_distance(std::string_view a, std::string_view b);

// The nearest candidate, if it is at most a typo away (a third of the length). A name that differs only by a
// number or a side ("left") is the last choice. nullopt: none is near.
DOPPEL_API std::optional<std::string> nearest_name(std::string_view name,
                                                   std::span<const std::string> candidates);

// "; did you mean 'x'?" With no near name and at most eight candidates "; there are: a, b, c"; of more
// candidates those that contain the name: "; did you mean 'x_1', 'x_2' or one of 9 others?" Else "".
DOPPEL_API std::string did_you_mean(std::string_view name, std::span<const std::string> candidates);

}  // namespace doppel
