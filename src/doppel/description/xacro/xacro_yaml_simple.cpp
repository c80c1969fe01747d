// The subset of YAML that most parameter files use, read in one pass: maps and lists by indentation, scalars
// and lists on one line, comments, quotes without escapes, units. A file with anything else is read by
// yaml-cpp; a file that is read here has the same values there.
//
// It exists beside yaml-cpp only for its speed: of 49 parameter files of public robots it reads 46, 22 times
// as fast (18 us against 402 us each), and expanding an arm that loads five of them, as the 25 descriptions
// of the corpus that load YAML do, takes 0.4 ms with it and 2.2 ms without (bench_xacro); `doppel xacro` of
// an arm without YAML takes 2.3 ms as typed.
#include <array>

#include "doppel/description/xacro/detail/xacro_yaml.h"

namespace doppel::xacro {
namespace {

constexpr int kMaxSimpleYamlDepth = 20;
struct NotSimple {};

// The roles of characters: what they may be part of, or end.
enum Role : std::uint8_t {
  kWord = 1,          // of a text's beginning
  kKey = 2,           // of a key
  kQuantity = 4,      // of a number with a unit
  kLineEnd = 8,       // may end a line or its content, or is not a printable ASCII character
  kNotInScalar = 16,  // of a scalar without quotes
  kNotInList = 32,    // of one in a list on one line
};

constexpr std::array<std::uint8_t, 256> kRoles = [] {
  std::array<std::uint8_t, 256> out{};
  const auto give = [&out](std::string_view characters, int role) {
    for (const char c : characters) out[static_cast<unsigned char>(c)] |= static_cast<std::uint8_t>(role);
  };
  give("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_", kWord | kKey);
  give("-./", kKey);
  give("0123456789.+-*/() epi", kQuantity);
  give("#\"'\x7f", kLineEnd);
  give("{}\"'", kNotInScalar);
  give("[]{},:#\"'?", kNotInList);
  for (std::size_t c = 0; c < out.size(); ++c) {
    if (c < ' ' || c > '~') out[c] |= kLineEnd;
  }
  return out;
}();

bool is(char c, Role role) {
  return (kRoles[static_cast<unsigned char>(c)] & role) != 0;
}

// The first character that may end a line or its content.
const char* plain_end(const char* at, const char* end) {
  while (at != end && !is(*at, kLineEnd)) ++at;
  return at;
}

// The lines that are not empty, one at a time.
class Lines {
 public:
  explicit Lines(std::string_view text) : at_(text.data()), end_(text.data() + text.size()) { next(); }

  [[nodiscard]] bool done() const { return text_.empty(); }
  [[nodiscard]] int indent() const { return indent_; }
  [[nodiscard]] std::string_view text() const { return text_; }  // without comment and blanks around
  [[nodiscard]] bool item() const { return text_[0] == '-' && (text_.size() == 1 || text_[1] == ' '); }
  [[nodiscard]] bool deeper(int indent) const { return !done() && indent_ > indent; }

  void next() {
    do {
      text_ = {};
      if (at_ == end_) return;
      read_line();
      if (text_.empty()) continue;
      const bool first = first_;
      first_ = false;
      if (first && text_ == "---" && indent_ == 0)
        text_ = {};
      else if (text_.starts_with("---") || text_.starts_with("...") || text_[0] == '%')
        throw NotSimple();
    } while (text_.empty());
  }

 private:
  void read_line() {
    const char *content = at_, *const end = end_;
    while (content != end && *content == ' ') ++content;
    indent_ = static_cast<int>(content - at_);
    odd_ = false;
    const char* stop = content_end(content);
    while (stop != content && stop[-1] == ' ') --stop;
    text_ = {content, static_cast<std::size_t>(stop - content)};
    if (odd_ && !text_.empty()) throw NotSimple();
  }

  // The place where a comment begins, or the line ends; quotes may hold a '#'. The line is read to its end.
  const char* content_end(const char* const content) {
    char quote = 0;
    for (const char* at = content;; ++at) {
      at = plain_end(at, end_);
      const char c = at == end_ ? '\n' : *at;
      const char before = at == content ? ' ' : at[-1];
      if (c == '"' || c == '\'') {
        if (quote == c)
          quote = 0;
        else if (quote == 0 && (before == ' ' || before == '[' || before == ','))
          quote = c;
      } else if (c == '#') {
        if (quote != 0 || before != ' ') continue;
        for (const char* rest = at + 1; !ends_line(rest = plain_end(rest, end_));) ++rest;
        return at;
      } else if (ends_line(at)) {
        return at;
      }
    }
  }

  // True if a line ends here; then reading continues behind it.
  bool ends_line(const char* at) {
    at_ = at;
    if (at == end_) return true;
    const char c = *at;
    if (c == '\r' && at + 1 != end_ && at[1] == '\n') ++at_;
    if (*at_ == '\n') return ++at_, true;
    if (c >= 0 && c < ' ') throw NotSimple();
    if (c < ' ' || c > '~') odd_ = true;
    return false;
  }

  const char* at_;
  const char* end_;
  std::string_view text_;
  int indent_ = 0;
  bool first_ = true;
  bool odd_ = false;  // the line contains characters other than printable ASCII
};

std::size_t first_not_blank(std::string_view text, std::size_t at) {
  while (at < text.size() && text[at] == ' ') ++at;
  return at;
}

class Reader {
 public:
  explicit Reader(std::string_view text) : lines_(text) {}

  Value whole() {
    if (lines_.done()) throw NotSimple();
    Value out = block(lines_.indent(), 0);
    if (!lines_.done()) throw NotSimple();
    return out;
  }

 private:
  Value block(int indent, int depth) {
    if (depth > kMaxSimpleYamlDepth) throw NotSimple();
    return lines_.item() ? list(indent) : map(indent, depth);
  }

  // Scalars only; nested lists and maps are read by yaml-cpp.
  Value list(int indent) {
    ValueList out;
    for (; !lines_.done() && lines_.indent() == indent && lines_.item(); lines_.next()) {
      const std::string_view text = lines_.text().substr(first_not_blank(lines_.text(), 1));
      if (text.empty() || text == "-" || text.starts_with("- ")) throw NotSimple();
      out.push_back(scalar(text, false));
    }
    if (lines_.deeper(indent)) throw NotSimple();
    return Value::list(std::move(out));
  }

  Value map(int indent, int depth) {
    ValueDict out;
    while (!lines_.done() && lines_.indent() == indent && !lines_.item()) {
      const std::string_view text = lines_.text();
      std::size_t colon = 0;
      while (colon < text.size() && is(text[colon], kKey)) ++colon;
      if (colon == 0 || colon == text.size() || text[colon] != ':' || !is(text[0], kWord)) throw NotSimple();
      if (colon + 1 < text.size() && text[colon + 1] != ' ') throw NotSimple();
      lines_.next();
      out.set(yaml_scalar(text.substr(0, colon)), value(text.substr(colon + 1), indent, depth));
    }
    if (lines_.deeper(indent)) throw NotSimple();
    return Value::dict(std::move(out), true);
  }

  Value value(std::string_view text, int indent, int depth) {
    const std::size_t begin = first_not_blank(text, 0);
    const bool deeper = lines_.deeper(indent);
    if (begin < text.size()) {
      if (deeper) throw NotSimple();  // a scalar over several lines
      return scalar(text.substr(begin), false);
    }
    if (deeper) return block(lines_.indent(), depth + 1);
    if (!lines_.done() && lines_.indent() == indent && lines_.item()) return list(indent);
    return {};
  }

  // A scalar or a list on one line, the whole of `text`.
  static Value scalar(std::string_view text, bool in_list) {
    const char first = text[0];
    if (first == '[') {
      std::size_t at = 0;
      Value out = flow(text, at, 0);
      if (at != text.size()) throw NotSimple();
      return out;
    }
    if (first == '"' || first == '\'') return quoted(text);
    if (first == '!') return quantity(text);
    if (text == "~") return {};
    const bool sign = (first == '-' || first == '+' || first == '.') && text.size() > 1 && text[1] != ' ';
    if (!is(first, kWord) && first != '/' && first != '$' && !sign) throw NotSimple();
    const Role refused = in_list ? kNotInList : kNotInScalar;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (is(text[i], refused)) throw NotSimple();
      if (text[i] == ':' && (i + 1 == text.size() || text[i + 1] == ' ')) throw NotSimple();
    }
    return yaml_scalar(text);
  }

  static Value quoted(std::string_view text) {
    if (text.size() < 2 || text.back() != text[0]) throw NotSimple();
    const std::string_view inner = text.substr(1, text.size() - 2);
    for (const char c : inner) {
      if (c == '"' || c == '\'' || c == '\\') throw NotSimple();
    }
    return Value(inner);
  }

  static Value quantity(std::string_view text) {
    const std::size_t space = text.find(' ');
    if (space == std::string_view::npos) throw NotSimple();
    const std::string_view number = text.substr(first_not_blank(text, space));
    for (const char c : number) {
      if (!is(c, kQuantity)) throw NotSimple();
    }
    if (number[0] == '*' || number.starts_with("- ")) throw NotSimple();
    const std::optional<Value> out = yaml_quantity(text.substr(0, space), number);
    if (!out) throw NotSimple();
    return *out;
  }

  static Value flow(std::string_view text, std::size_t& at, int depth) {
    if (depth > kMaxSimpleYamlDepth) throw NotSimple();
    ValueList out;
    at = first_not_blank(text, at + 1);
    while (at < text.size() && text[at] != ']') {
      if (text[at] == '[') {
        out.push_back(flow(text, at, depth + 1));
      } else {
        const std::size_t begin = at;
        std::size_t end = at;  // behind the last that is not blank
        for (; at < text.size() && text[at] != ',' && text[at] != ']'; ++at) {
          if (text[at] != ' ') end = at + 1;
        }
        if (end == begin) throw NotSimple();
        out.push_back(scalar(text.substr(begin, end - begin), true));
      }
      at = first_not_blank(text, at);
      if (at < text.size() && text[at] == ',')
        at = first_not_blank(text, at + 1);
      else if (at >= text.size() || text[at] != ']')
        throw NotSimple();
    }
    if (at >= text.size()) throw NotSimple();
    at = first_not_blank(text, at + 1);
    return Value::list(std::move(out));
  }

  Lines lines_;
};

}  // namespace

std::optional<Value> parse_simple_yaml(std::string_view text) {
  try {
    return Reader(text).whole();
  } catch (const NotSimple&) {
    return std::nullopt;
  } catch (const ExpressionError&) {
    return std::nullopt;
  }
}

}  // namespace doppel::xacro
