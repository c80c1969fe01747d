#pragma once
// Parts of a report that several of its forms need.

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "doppel/validation/checks/validation_report.h"

namespace doppel {

// An unknown check is an extra, a test or a gate by its first letter.
[[nodiscard]] CheckKind kind_of(const CheckResult& check);
[[nodiscard]] std::string_view heading_of(CheckKind kind);  // "Gates"

// True for an item that a person reads first: failed, not run, not judged, warned, waived.
[[nodiscard]] bool is_notable(const CheckItem& item);

// "settling 0.62 s (limit 0.5 s)", with the subject.
[[nodiscard]] std::string metric_text(const Metric& metric);
[[nodiscard]] std::string number_text(double value);  // four digits
[[nodiscard]] std::string regression_text(const Regression& regression);
// "T4: settling of Revolute 2 0.31 -> 0.22 s"
[[nodiscard]] std::string improvement_text(const Regression& improvement);
[[nodiscard]] std::string_view effort_text(Effort effort);

// A word of a POSIX shell: "out", "'my report'".
[[nodiscard]] std::string shell_word(const std::string& text);

// The item's sentence with its subject, without the fix.
[[nodiscard]] std::string sentence_of(const CheckItem& item);

// Valid in XML 1.0 and HTML: what is not UTF-8 or not a character there is U+FFFD.
[[nodiscard]] std::string markup(std::string_view text);

}  // namespace doppel
