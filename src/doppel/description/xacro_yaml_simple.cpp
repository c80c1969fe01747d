// The plain part of YAML that most parameter files keep to, read in one pass: maps and lists by indentation,
// scalars and lists on one line, comments, quotes without escapes, units. Whatever else a file holds makes it
// none of these, and it is read by yaml-cpp; a file that is read here says the same there.
#include <algorithm>

#include "doppel/description/xacro_yaml.h"

namespace doppel::xacro {
namespace {

constexpr int kDeepest = 20;
struct NotSimple {};

bool word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

struct Line {
  int indent = 0;
  std::string_view text;  // without indentation, comment and blanks behind
};

// Without a comment and the blanks in front of it; quotes may hold a '#'.
std::string_view without_comment(std::string_view text) {
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool begins = i == 0 || text[i - 1] == ' ' || text[i - 1] == '[' || text[i - 1] == ',';
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if ((c == '"' || c == '\'') && begins) {
      quote = c;
    } else if (c == '#' && (i == 0 || text[i - 1] == ' ')) {
      text = text.substr(0, i);
      break;
    }
  }
  const std::size_t end = text.find_last_not_of(' ');
  return text.substr(0, end == std::string_view::npos ? 0 : end + 1);
}

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> out;
  bool first = true;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (end < text.size() && line.ends_with('\r')) line.remove_suffix(1);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t indent = line.find_first_not_of(' ');
    if (indent == std::string_view::npos) continue;
    const bool odd = std::any_of(line.begin(), line.end(), [](char c) { return c < ' ' || c > '~'; });
    const std::string_view content = without_comment(line.substr(indent));
    if (odd && !content.empty()) throw NotSimple();
    if (odd && std::any_of(line.begin(), line.end(), [](char c) { return c >= 0 && c < ' '; }))
      throw NotSimple();
    if (content.empty()) continue;
    if (first && content == "---" && indent == 0) {
      first = false;
      continue;
    }
    first = false;
    if (content.starts_with("---") || content.starts_with("...") || content[0] == '%') throw NotSimple();
    out.push_back({static_cast<int>(indent), content});
  }
  return out;
}

class Reader {
 public:
  explicit Reader(std::vector<Line> lines) : lines_(std::move(lines)) {}

  Value whole() {
    if (lines_.empty()) throw NotSimple();
    Value out = block(lines_[0].indent, 0);
    if (at_ != lines_.size()) throw NotSimple();
    return out;
  }

 private:
  static bool item(const Line& line) { return line.text == "-" || line.text.starts_with("- "); }

  Value block(int indent, int depth) {
    if (depth > kDeepest) throw NotSimple();
    return item(lines_[at_]) ? list(indent) : map(indent, depth);
  }

  // Scalars only; what is deeper is left to the other reader.
  Value list(int indent) {
    ValueList out;
    for (; at_ < lines_.size() && lines_[at_].indent == indent && item(lines_[at_]); ++at_) {
      std::string_view text = lines_[at_].text;
      text.remove_prefix(std::min(std::max<std::size_t>(1, text.find_first_not_of(' ', 1)), text.size()));
      if (text.empty() || text == "-" || text.starts_with("- ")) throw NotSimple();
      out.push_back(scalar(text, false));
    }
    if (at_ < lines_.size() && lines_[at_].indent > indent) throw NotSimple();
    return Value::list(std::move(out));
  }

  Value map(int indent, int depth) {
    ValueDict out;
    while (at_ < lines_.size() && lines_[at_].indent == indent && !item(lines_[at_])) {
      const std::string_view text = lines_[at_].text;
      const std::size_t colon = text.find(':');
      if (colon == std::string_view::npos || colon == 0 || !word(text[0])) throw NotSimple();
      const std::string_view key = text.substr(0, colon);
      const bool plain = std::all_of(key.begin(), key.end(),
                                     [](char c) { return word(c) || c == '-' || c == '.' || c == '/'; });
      if (!plain || (colon + 1 < text.size() && text[colon + 1] != ' ')) throw NotSimple();
      ++at_;
      out.set(yaml_scalar(std::string(key)), value(text.substr(colon + 1), indent, depth));
    }
    if (at_ < lines_.size() && lines_[at_].indent > indent) throw NotSimple();
    return Value::dict(std::move(out), true);
  }

  Value value(std::string_view text, int indent, int depth) {
    const std::size_t begin = text.find_first_not_of(' ');
    const bool more = at_ < lines_.size();
    const bool deeper = more && lines_[at_].indent > indent;
    if (begin != std::string_view::npos) {
      if (deeper) throw NotSimple();  // a scalar over several lines
      return scalar(text.substr(begin), false);
    }
    if (deeper) return block(lines_[at_].indent, depth + 1);
    if (more && lines_[at_].indent == indent && item(lines_[at_])) return list(indent);
    return {};
  }

  // A scalar or a list on one line, the whole of `text`.
  static Value scalar(std::string_view text, bool in_list) {
    if (text[0] == '[') {
      std::size_t at = 0;
      Value out = flow(text, at, 0);
      if (at != text.size()) throw NotSimple();
      return out;
    }
    if (text[0] == '"' || text[0] == '\'') {
      const std::string_view inner = text.substr(1, text.size() - (text.size() > 1 ? 2 : 1));
      if (text.size() < 2 || text.back() != text[0] || inner.find_first_of("\"'\\") != std::string_view::npos)
        throw NotSimple();
      return Value(std::string(inner));
    }
    if (text[0] == '!') return quantity(text);
    if (text == "~") return {};
    const bool sign =
        (text[0] == '-' || text[0] == '+' || text[0] == '.') && text.size() > 1 && text[1] != ' ';
    if (!word(text[0]) && text[0] != '/' && text[0] != '$' && !sign) throw NotSimple();
    const char* const special = in_list ? "[]{},:#\"'" : "{}\"'";
    if (text.find_first_of(special) != std::string_view::npos || text.find(": ") != std::string_view::npos ||
        text.back() == ':')
      throw NotSimple();
    return yaml_scalar(std::string(text));
  }

  static Value quantity(std::string_view text) {
    const std::size_t space = text.find(' ');
    if (space == std::string_view::npos) throw NotSimple();
    const std::size_t begin = text.find_first_not_of(' ', space);
    const std::string_view number = text.substr(begin);
    if (number.find_first_not_of("0123456789.+-*/() epi") != std::string_view::npos || number[0] == '*' ||
        number.starts_with("- "))
      throw NotSimple();
    const std::optional<Value> out = yaml_quantity(std::string(text.substr(0, space)), std::string(number));
    if (!out) throw NotSimple();
    return *out;
  }

  static Value flow(std::string_view text, std::size_t& at, int depth) {
    if (depth > kDeepest) throw NotSimple();
    const auto skip = [&] {
      while (at < text.size() && text[at] == ' ') ++at;
    };
    ValueList out;
    ++at;
    for (skip(); at < text.size() && text[at] != ']'; skip()) {
      if (text[at] == '[') {
        out.push_back(flow(text, at, depth + 1));
      } else {
        const std::size_t end = std::min(text.find_first_of(",]", at), text.size());
        const std::size_t last = text.find_last_not_of(' ', end == 0 ? 0 : end - 1);
        if (end == at || last == std::string_view::npos || last < at) throw NotSimple();
        out.push_back(scalar(text.substr(at, last - at + 1), true));
        at = end;
      }
      skip();
      if (at < text.size() && text[at] == ',')
        ++at;
      else if (at >= text.size() || text[at] != ']')
        throw NotSimple();
    }
    if (at >= text.size()) throw NotSimple();
    ++at;
    skip();
    return Value::list(std::move(out));
  }

  std::vector<Line> lines_;
  std::size_t at_ = 0;
};

}  // namespace

std::optional<Value> parse_simple_yaml(std::string_view text) {
  try {
    return Reader(lines_of(text)).whole();
  } catch (const NotSimple&) {
    return std::nullopt;
  } catch (const ExpressionError&) {
    return std::nullopt;
  }
}

}  // namespace doppel::xacro
