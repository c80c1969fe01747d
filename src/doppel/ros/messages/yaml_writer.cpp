// YAML as `ros2 topic echo` prints it, that is as PyYAML's block style writes it.

#include <fmt/format.h>

#include <regex>

#include "doppel/base/core/utf8.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel {
namespace {

// True if PyYAML (its YAML 1.1 resolver) would read the plain text as another type.
bool looks_like_another_type(std::string_view text) {
  static const std::regex pattern(
      "|~|null|Null|NULL|<<|=|yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF"
      "|[-+]?(0b[01_]+|0[0-7_]+|0|[1-9][0-9_]*|0x[0-9a-fA-F_]+|[1-9][0-9_]*(:[0-5]?[0-9])+)"
      "|[-+]?[0-9][0-9_]*\\.[0-9_]*([eE][-+][0-9]+)?|\\.[0-9][0-9_]*([eE][-+][0-9]+)?"
      "|[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+\\.[0-9_]*|[-+]?\\.(inf|Inf|INF)|\\.(nan|NaN|NAN)"
      "|[0-9]{4}-[0-9][0-9]?-[0-9][0-9]?([Tt ].*)?");
  return text.size() < 64 && std::regex_match(text.begin(), text.end(), pattern);
}

bool is_printable(char32_t c) {
  return c == U'\n' || (c >= U' ' && c <= U'~') || c == 0x85 || (c >= 0xA0 && c <= 0xD7FF) ||
         (c >= 0xE000 && c <= 0xFFFD && c != 0xFEFF) || (c >= 0x10000 && c <= 0x10FFFF);
}

bool is_break(char32_t c) {
  return c == U'\n' || c == 0x85 || c == 0x2028 || c == 0x2029;
}
bool is_white(char32_t c) {
  return c == U'\0' || c == U' ' || c == U'\t' || c == U'\r' || is_break(c);
}

bool contains(std::string_view set, char32_t c) {
  return c < 128 && set.find(static_cast<char>(c)) != set.npos;
}

enum class Style { plain, single_quoted, double_quoted };

// PyYAML's Emitter.analyze_scalar and choose_scalar_style for a value in block context.
Style style_of(std::string_view text) {
  bool indicator = text.starts_with("---") || text.starts_with("..."), special = false, breaks = false;
  bool break_then_space = false, space_then_break = false, white_before = true;
  char32_t before = 0;
  for (std::size_t at = 0; at < text.size();) {
    const bool first = at == 0;
    const Utf8Char c = next_utf8(text, at);
    at += c.size;
    const bool white_after = at >= text.size() || is_white(next_utf8(text, at).code);
    if (first) {
      indicator |= contains("#,[]{}&*!|>'\"%@`", c.code) || (white_after && contains("?:-", c.code));
    } else {
      indicator |= (c.code == U':' && white_after) || (c.code == U'#' && white_before);
    }
    special |= !c.valid || !is_printable(c.code);
    breaks |= is_break(c.code);
    break_then_space |= c.code == U' ' && !first && is_break(before);
    space_then_break |= is_break(c.code) && before == U' ';
    white_before = is_white(c.code);
    before = c.code;
  }
  // PyYAML also uses single quotes for line breaks at the ends, but yaml-cpp would not read them back.
  const bool break_ends = !text.empty() && (text.front() == '\n' || text.back() == '\n');
  if (special || break_then_space || space_then_break || break_ends) return Style::double_quoted;
  const bool white_ends = !text.empty() && (text.front() == ' ' || text.back() == ' ');
  if (indicator || breaks || white_ends || looks_like_another_type(text)) return Style::single_quoted;
  return Style::plain;
}

std::string single_quoted(std::string_view text, std::size_t indent) {
  std::string out = "'";
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '\'') out += '\'';
    if (text[at] != '\n') {
      out += text[at];
      continue;
    }
    out += '\n';  // one line break alone would be folded into a space
    while (at < text.size() && text[at] == '\n') out += text[at++];
    --at;
    out += std::string(indent, ' ');
  }
  return out + "'";
}

std::string double_quoted(std::string_view text) {
  constexpr std::string_view kLetters = "0abtnvfre\"\\";
  static const std::string codes("\0\a\b\t\n\v\f\r\x1b\"\\", kLetters.size());
  std::string out = "\"";
  for (std::size_t at = 0; at < text.size();) {
    const Utf8Char c = next_utf8(text, at);
    const std::size_t letter = c.code < 128 ? codes.find(static_cast<char>(c.code)) : codes.npos;
    if (letter != codes.npos) {
      out += {'\\', kLetters[letter]};
    } else if (c.valid && is_printable(c.code) && !is_break(c.code)) {
      out += text.substr(at, c.size);
    } else if (c.code <= 0xFF) {
      out += fmt::format("\\x{:02X}", static_cast<unsigned>(c.code));
    } else {
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(c.code));
    }
    at += c.size;
  }
  return out + "\"";
}

std::string yaml_real(double value) {
  std::string text = shortest_decimal(value);
  if (text == "nan") return ".nan";
  if (text == "inf") return ".inf";
  if (text == "-inf") return "-.inf";
  const std::size_t e = text.find('e');  // YAML 1.1 requires a dot in a float: 1.0e-05
  if (e != text.npos && text.find('.') == text.npos) text.insert(e, ".0");
  return text;
}

class YamlWriter : public ValueSink {
 public:
  explicit YamlWriter(std::string& out) : out_(out) {}

  void begin_message(const TypeDescription& type) override {
    outer_.push_back(place_);
    if (type.fields.empty()) {
      if (place_ == Place::top) {
        out_ += "{}\n";
      } else {
        scalar("{}");
      }
    } else if (place_ == Place::field) {
      out_ += '\n';
    } else if (place_ == Place::item) {
      out_ += std::string(indent_, ' ') + "- ";
      behind_dash_ = true;
    }
    if (place_ != Place::top) indent_ += 2;
  }
  void field(const FieldDescription& field) override {
    if (!behind_dash_) out_ += std::string(indent_, ' ');
    behind_dash_ = false;
    out_ += field.name + ":";
    place_ = Place::field;
  }
  void end_message() override {
    place_ = outer_.back();
    outer_.pop_back();
    if (place_ != Place::top) indent_ -= 2;
  }
  void begin_list(std::size_t size) override {
    out_ += size == 0 ? " []\n" : "\n";
    place_ = Place::item;
  }
  void end_list() override { place_ = Place::field; }
  void boolean(bool value) override { scalar(value ? "true" : "false"); }
  void integer(std::int64_t value) override { scalar(std::to_string(value)); }
  void natural(std::uint64_t value) override { scalar(std::to_string(value)); }
  void real(double value) override { scalar(yaml_real(value)); }
  void text(std::string_view value) override {
    const Style style = style_of(value);
    if (style == Style::plain) {
      scalar(value);
    } else {
      scalar(style == Style::single_quoted ? single_quoted(value, indent_ + 2) : double_quoted(value));
    }
  }

 private:
  enum class Place { top, field, item };

  void scalar(std::string_view text) {
    out_ += place_ == Place::item ? std::string(indent_, ' ') + "- " : " ";
    out_ += text;
    out_ += '\n';
  }

  std::string& out_;
  Place place_ = Place::top;
  std::vector<Place> outer_;
  std::size_t indent_ = 0;
  bool behind_dash_ = false;
};

}  // namespace

Status cdr_to_yaml(const TypeDescription& type, std::span<const std::byte> cdr, std::string& out) {
  out.clear();
  YamlWriter writer(out);
  return walk_cdr(type, cdr, writer);
}

}  // namespace doppel
