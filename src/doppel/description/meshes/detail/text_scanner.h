#pragma once
// Words and numbers of a text file, without copies; numbers as in the C locale, independent of the user's.

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace doppel {

class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : text_(text) {}

  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }

  // The next word, also in a later line; empty at the end.
  std::string_view word() {
    skip([](char c) { return blank(c) || c == '\n'; });
    return take();
  }
  // The next word of this line; empty at its end.
  std::string_view word_in_line() {
    skip(blank);
    return take();
  }
  // The next word as a number; nullopt: it is not a finite number.
  std::optional<double> number() { return to_number(word()); }
  // The rest of the line; the next word is the next line's first.
  std::string_view rest_of_line() {
    skip(blank);
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view rest = text_.substr(at_, end - at_);
    while (!rest.empty() && blank(rest.back())) rest.remove_suffix(1);
    at_ = end;
    next_line();
    return rest;
  }
  void skip_line() { rest_of_line(); }
  // Skips the end of the line, if the scanner is there.
  bool next_line() {
    if (at_end() || text_[at_] != '\n') return false;
    ++at_;
    ++line_;
    return true;
  }

  static std::optional<double> to_number(std::string_view word) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || end != word.data() + word.size()) return std::nullopt;
    if (error == std::errc::result_out_of_range) return tiny(word) ? std::optional(0.0) : std::nullopt;
    if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
    return value;
  }

 private:
  static bool blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' || c == '\0';
  }
  // True if a number out of range is an underflow, which is 0: exporters write 1e-320 for zero.
  static bool tiny(std::string_view word) {
    const std::size_t e = word.find_first_of("eE");
    return e == std::string_view::npos || (e + 1 < word.size() && word[e + 1] == '-');
  }
  template <class Predicate>
  void skip(Predicate wanted) {
    while (!at_end() && wanted(text_[at_])) {
      if (text_[at_] == '\n') ++line_;
      ++at_;
    }
  }
  std::string_view take() {
    const std::size_t begin = at_;
    while (!at_end() && !blank(text_[at_]) && text_[at_] != '\n') ++at_;
    return text_.substr(begin, at_ - begin);
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

}  // namespace doppel
