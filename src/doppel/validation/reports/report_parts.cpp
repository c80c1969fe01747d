#include "doppel/validation/reports/detail/report_parts.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

namespace doppel {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

// The length of the character at `text`'s begin, 0: it is not one of XML 1.0 in UTF-8. Source: RFC 3629.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return first >= 0x20 || first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
  const std::size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
  if (length == 0 || text.size() < length) return 0;
  char32_t code = first & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3F);
  }
  constexpr std::array<char32_t, 5> kMinCode = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_valid = code >= kMinCode[length] && code <= 0x10FFFF && !(code >= 0xD800 && code < 0xE000) &&
                        code != 0xFFFE && code != 0xFFFF;
  return is_valid ? length : 0;
}

}  // namespace

CheckKind kind_of(const CheckResult& check) {
  if (const CheckInfo* const info = find_check(check.id)) return info->kind;
  return check.id.starts_with('G')   ? CheckKind::gate
         : check.id.starts_with('T') ? CheckKind::test
                                     : CheckKind::extra;
}

std::string_view heading_of(CheckKind kind) {
  return kind == CheckKind::gate ? "Gates" : kind == CheckKind::test ? "Tests" : "Extras";
}

bool is_notable(const CheckItem& item) {
  return item.verdict != Verdict::passed && item.verdict != Verdict::not_applicable;
}

std::string shell_word(const std::string& text) {
  const bool is_plain = std::ranges::all_of(text, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-./=+:,").find(c) != std::string_view::npos;
  });
  if (is_plain && !text.empty()) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::string number_text(double value) {
  return fmt::format("{:.4g}", value == 0 ? 0.0 : value);
}

std::string metric_text(const Metric& metric) {
  const std::string unit = metric.unit.empty() ? "" : " " + metric.unit;
  std::string out = metric.subject.empty() ? "" : metric.subject + ": ";
  out += fmt::format("{} {}{}", metric.name, number_text(metric.value), unit);
  if (metric.limit) out += fmt::format(" (limit {}{})", number_text(*metric.limit), unit);
  return out;
}

std::string regression_text(const Regression& regression) {
  const Metric& now = regression.metric;
  const std::string unit = now.unit.empty() ? "" : " " + now.unit;
  std::string out = regression.check + ": " + now.name;
  if (!now.subject.empty()) out += " of " + now.subject;
  out +=
      fmt::format(" {}{}, before {}{}", number_text(now.value), unit, number_text(regression.before), unit);
  const double before = std::abs(regression.before);
  if (std::isfinite(now.value) && before > 0)
    out += fmt::format(" ({:+.3g} %)", 100 * (now.value - regression.before) / before);
  return out;
}

std::string improvement_text(const Regression& improvement) {
  const Metric& now = improvement.metric;
  const std::string subject = now.subject.empty() ? "" : " of " + now.subject;
  return fmt::format("{}: {}{} {} -> {}{}", improvement.check, now.name, subject,
                     number_text(improvement.before), number_text(now.value),
                     now.unit.empty() ? "" : " " + now.unit);
}

std::string_view effort_text(Effort effort) {
  return effort == Effort::quick ? "quick" : effort == Effort::full ? "full" : "standard";
}

std::string sentence_of(const CheckItem& item) {
  if (item.subject.empty()) return item.message;
  return item.message.empty() ? item.subject : item.subject + ": " + item.message;
}

std::string markup(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const char first = text.front();
    if (length == 0) {
      out += kReplacement;
    } else if (first == '&') {
      out += "&amp;";
    } else if (first == '<') {
      out += "&lt;";
    } else if (first == '>') {
      out += "&gt;";
    } else if (first == '"') {
      out += "&quot;";
    } else if (first == '\'') {
      out += "&#39;";
    } else {
      out += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

}  // namespace doppel
