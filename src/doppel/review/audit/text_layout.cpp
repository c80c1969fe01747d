#include "doppel/review/audit/text_layout.h"

#include <fmt/format.h>

#include <algorithm>

namespace doppel {
namespace {

constexpr std::size_t kMinWidth = 24;  // of a text's column: narrower, the text exceeds the terminal's width

std::string harmless(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x20 && c != '\n') || byte == 0x7f) c = '?';
  }
  return out;
}

}  // namespace

std::size_t display_width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string TextLayout::toned(TextTone tone, std::string_view text) const {
  if (!colour_ || tone == TextTone::plain || text.empty()) return std::string(text);
  constexpr std::string_view kCodes[] = {"", "1", "2", "1;31", "1;33", "1;36"};
  return fmt::format("\x1b[{}m{}\x1b[0m", kCodes[static_cast<std::size_t>(tone)], text);
}

void TextLayout::heading(TextTone tone, std::string_view word, const std::string& title,
                         const std::string& id) {
  const std::string what = harmless(title);
  const std::size_t used = word.size() + 2 + display_width(what) + display_width(id);
  const std::size_t gap = used + 2 <= width_ ? width_ - used : 2;
  out_ += fmt::format("{}  {}{}{}\n", toned(tone, word), toned(TextTone::strong, what), std::string(gap, ' '),
                      toned(TextTone::quiet, harmless(id)));
}

void TextLayout::paragraph(std::size_t indent, const std::string& text, TextTone tone) {
  out_.append(indent, ' ');
  wrapped(indent, indent, text, tone);
}

void TextLayout::labelled(std::size_t indent, const std::string& label, const std::string& text) {
  if (text.empty()) return;
  out_.append(indent, ' ');
  out_ += toned(TextTone::quiet, label + ": ");
  const std::size_t at = indent + display_width(label) + 2;
  wrapped(at, indent + 2, text, TextTone::plain);
}

void TextLayout::entry(std::size_t indent, const std::string& subject, std::size_t column,
                       const std::string& text, TextTone tone) {
  const std::string who = harmless(subject);
  out_.append(indent, ' ');
  out_ += toned(TextTone::strong, who);
  const std::size_t begin = indent + column + 2, at = indent + display_width(who);
  if (at + 2 > begin) {
    out_ += '\n';
    out_.append(begin, ' ');
  } else {
    out_.append(begin - at, ' ');
  }
  wrapped(begin, begin, text, tone);
}

void TextLayout::row(const std::vector<std::pair<TextTone, std::string>>& parts, const std::string& text) {
  std::size_t column = 0;
  for (const auto& [tone, part] : parts) {
    const std::string clean = harmless(part);
    out_ += toned(tone, clean);
    column += display_width(clean);
  }
  wrapped(column, column, text, TextTone::plain);
}

void TextLayout::line(const std::vector<std::pair<TextTone, std::string>>& parts) {
  for (const auto& [tone, text] : parts) out_ += toned(tone, harmless(text));
  out_ += '\n';
}

void TextLayout::wrapped(std::size_t at, std::size_t indent, const std::string& text, TextTone tone) {
  const std::string clean = harmless(text);
  const std::size_t edge = std::max(width_, indent + kMinWidth);
  std::string row;
  const auto flush = [&] {
    out_ += toned(tone, row);
    out_ += '\n';
    row.clear();
  };
  std::size_t i = 0;
  while (i < clean.size()) {
    if (clean[i] == '\n') {
      flush();
      // Manual indentation is kept, relative to the beginning of the text.
      const std::size_t from = clean.find_first_not_of(' ', i + 1);
      const std::size_t own = from == std::string::npos ? 0 : from - i - 1;
      out_.append(indent + own, ' ');
      at = indent + own;
      i = std::min(from, clean.size());
      continue;
    }
    const std::size_t begin = clean.find_first_not_of(' ', i);
    if (begin == std::string::npos) break;
    const std::size_t end = std::min(clean.find_first_of(" \n", begin), clean.size());
    const std::string word = clean.substr(begin, end - begin);
    const bool first = row.empty();
    if (!first && at + 1 + display_width(word) > edge) {
      flush();
      out_.append(indent, ' ');
      at = indent;
    } else if (!first) {
      row += ' ';
      ++at;
    }
    row += word;
    at += display_width(word);
    i = end;
  }
  flush();
}

}  // namespace doppel
