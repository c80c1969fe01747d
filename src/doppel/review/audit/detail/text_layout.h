#pragma once
// Lines for a terminal: wrapped at its width, indented, coloured where it has colours. Control characters in
// the text are never written to the terminal.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace doppel::audit_rules {

enum class Tone { plain, strong, quiet, bad, careful, calm };

std::size_t display_width(std::string_view text);  // in characters of UTF-8

class Layout {
 public:
  Layout(bool colour, int width) : colour_(colour), width_(static_cast<std::size_t>(width)) {}

  // "error  title ....... id", the id at the right end.
  void heading(Tone tone, std::string_view word, const std::string& title, const std::string& id);
  void paragraph(std::size_t indent, const std::string& text, Tone tone = Tone::plain);
  void quiet(std::size_t indent, const std::string& text) { paragraph(indent, text, Tone::quiet); }
  // "label: text", further lines are indented to the text.
  void labelled(std::size_t indent, const std::string& label, const std::string& text);
  // "subject   text": the text begins at a column of its own.
  void entry(std::size_t indent, const std::string& subject, std::size_t column, const std::string& text,
             Tone tone = Tone::plain);
  void line(const std::vector<std::pair<Tone, std::string>>& parts);
  void blank() { out_ += '\n'; }
  std::string take() { return std::move(out_); }

 private:
  [[nodiscard]] std::string toned(Tone tone, std::string_view text) const;
  // Writes `text` from the current column `at` on; wrapped lines are indented by `indent`.
  void wrapped(std::size_t at, std::size_t indent, const std::string& text, Tone tone);

  bool colour_;
  std::size_t width_;
  std::string out_;
};

}  // namespace doppel::audit_rules
