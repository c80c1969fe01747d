#pragma once
// Lines for a terminal: wrapped at its width, indented, coloured where it has colours. Control characters in
// the text are never written to the terminal.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/export.h"

namespace doppel {

enum class TextTone { plain, strong, quiet, bad, careful, calm };

DOPPEL_API std::size_t display_width(std::string_view text);  // in characters of UTF-8

class DOPPEL_API TextLayout {
 public:
  TextLayout(bool colour, int width) : colour_(colour), width_(static_cast<std::size_t>(width)) {}

  // "error  title ....... id", the id at the right end.
  void heading(TextTone tone, std::string_view word, const std::string& title, const std::string& id);
  void paragraph(std::size_t indent, const std::string& text, TextTone tone = TextTone::plain);
  void quiet(std::size_t indent, const std::string& text) { paragraph(indent, text, TextTone::quiet); }
  // "label: text", further lines are indented to the text.
  void labelled(std::size_t indent, const std::string& label, const std::string& text);
  // "subject   text": the text begins at a column of its own.
  void entry(std::size_t indent, const std::string& subject, std::size_t column, const std::string& text,
             TextTone tone = TextTone::plain);
  // The parts, then the text in a column that begins after them.
  void row(const std::vector<std::pair<TextTone, std::string>>& parts, const std::string& text);
  void line(const std::vector<std::pair<TextTone, std::string>>& parts);
  void blank() { out_ += '\n'; }
  std::string take() { return std::move(out_); }

 private:
  [[nodiscard]] std::string toned(TextTone tone, std::string_view text) const;
  // Writes `text` from the current column `at` on; wrapped lines are indented by `indent`.
  void wrapped(std::size_t at, std::size_t indent, const std::string& text, TextTone tone);

  bool colour_;
  std::size_t width_;
  std::string out_;
};

}  // namespace doppel
