#pragma once
// Columns of text for terminals.

#include <string>
#include <string_view>
#include <vector>

namespace doppel {

using TableRow = std::vector<std::string>;

// Two blanks between columns, none at the ends of lines; counted in characters, not bytes. `right`: columns
// that are aligned to the right, by index.
std::string text_table(const std::vector<TableRow>& rows, const std::vector<std::size_t>& right = {});

}  // namespace doppel
