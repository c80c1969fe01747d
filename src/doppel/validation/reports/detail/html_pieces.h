#pragma once
// The unchanging pieces of the HTML report.

#include <string_view>

namespace doppel {

[[nodiscard]] std::string_view report_style();   // CSS
[[nodiscard]] std::string_view report_script();  // JavaScript: the arm, copying, printing

}  // namespace doppel
