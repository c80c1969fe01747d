#include "doppel/review/conversion/detail/table.h"

#include <algorithm>

#include "doppel/review/conversion/detail/drawing.h"

namespace doppel {

std::string text_table(const std::vector<TableRow>& rows, const std::vector<std::size_t>& right) {
  const auto length = [](const std::string& cell) { return code_points(cell).size(); };
  std::vector<std::size_t> widths;
  for (const TableRow& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], length(row[i]));
  }
  std::string out;
  for (const TableRow& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string blanks(widths[i] - length(row[i]), ' ');
      const bool to_right = std::find(right.begin(), right.end(), i) != right.end();
      line += (to_right ? blanks + row[i] : row[i] + blanks) + "  ";
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

}  // namespace doppel
