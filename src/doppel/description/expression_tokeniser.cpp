// Python's lexical rules, as far as expressions need them.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>

#include "doppel/description/expression_parser.h"
#include "doppel/description/xml_encoding.h"

namespace doppel {
namespace {

constexpr std::size_t kMostTokens = 20'000;

bool digit(char c) {
  return c >= '0' && c <= '9';
}
bool starts_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
         static_cast<unsigned char>(c) >= 0x80;
}
bool in_name(char c) {
  return starts_name(c) || digit(c);
}
int hex(char c) {
  if (digit(c)) return c - '0';
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

class Tokeniser {
 public:
  explicit Tokeniser(std::string_view text) : text_(text) {}

  std::vector<Token> all() {
    std::vector<Token> out;
    while (true) {
      skip();
      if (at_ >= text_.size()) break;
      if (out.size() >= kMostTokens) throw ExpressionError("the expression is too long");
      out.push_back(next());
    }
    out.push_back({});
    return out;
  }

 private:
  [[nodiscard]] char at(std::size_t i) const { return i < text_.size() ? text_[i] : '\0'; }
  void skip() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '#')
        at_ = std::min(text_.find('\n', at_), text_.size());
      else if (c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f')
        ++at_;
      else
        return;
    }
  }

  Token next() {
    const char c = text_[at_];
    if (digit(c) || (c == '.' && digit(at(at_ + 1)))) return number();
    if (starts_name(c) || c == '\'' || c == '"') return word();
    static constexpr std::array<std::string_view, 31> kSymbols{
        "**", "//", "==", "!=", "<=", ">=", "<<", ">>", ":=", "->", "+", "-", "*", "/", "%", "<",
        ">",  "(",  ")",  "[",  "]",  "{",  "}",  ",",  ":",  ".",  "|", "&", "^", "~", "="};
    for (const std::string_view known : kSymbols) {
      if (text_.substr(at_, known.size()) == known) {
        at_ += known.size();
        return {Token::Kind::symbol, std::string(known), {}};
      }
    }
    throw ExpressionError(fmt::format("'{}' has no meaning at column {} of '{}'", c, at_ + 1, text_));
  }

  // A name, or a string with its prefix.
  Token word() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    std::string prefix(text_.substr(begin, at_ - begin));
    const char quote = at(at_);
    if (prefix.size() > 2 || (quote != '\'' && quote != '"'))
      return {Token::Kind::name, std::move(prefix), {}};
    bool raw = false, format = false;
    for (const char p : prefix) {
      const char lower = static_cast<char>(p | 0x20);
      if (lower != 'r' && lower != 'f' && lower != 'u')
        throw ExpressionError(fmt::format("strings with the prefix '{}' are not supported", prefix));
      raw = raw || lower == 'r';
      format = format || lower == 'f';
    }
    return string(raw, format);
  }

  [[noreturn]] void bad_number(std::size_t begin) const {
    std::size_t end = at_;
    while (end < text_.size() && in_name(text_[end])) ++end;
    throw ExpressionError(fmt::format("'{}' is no number", text_.substr(begin, end - begin)));
  }

  std::string digits(bool (*wanted)(char)) {
    std::string out;
    while (at_ < text_.size() &&
           (wanted(text_[at_]) || (text_[at_] == '_' && !out.empty() && wanted(at(at_ + 1))))) {
      if (text_[at_] != '_') out += text_[at_];
      ++at_;
    }
    return out;
  }

  Token number() {
    const std::size_t begin = at_;
    if (text_[at_] == '0') {
      for (const auto& [letter, base] : {std::pair{'x', 16}, std::pair{'o', 8}, std::pair{'b', 2}}) {
        if ((at(at_ + 1) | 0x20) == letter) return based(begin, base);
      }
    }
    std::string whole = digits(digit), text = whole;
    bool real = false;
    if (at(at_) == '.') {
      real = true;
      ++at_;
      text += "." + digits(digit);
    }
    const std::size_t sign = at(at_ + 1) == '+' || at(at_ + 1) == '-' ? 1 : 0;
    if ((at(at_) | 0x20) == 'e' && digit(at(at_ + 1 + sign))) {
      real = true;
      text += text_.substr(at_, 1 + sign);
      at_ += 1 + sign;
      text += digits(digit);
    }
    if (in_name(at(at_)) && !keyword_follows()) bad_number(begin);
    if (!real && whole.size() > 1 && whole[0] == '0' && whole.find_first_not_of('0') != std::string::npos)
      throw ExpressionError(fmt::format("leading zeros in '{}' are not allowed; write {}", whole,
                                        whole.substr(whole.find_first_not_of('0'))));
    if (real) {
      double value = 0;
      if (!parse_real(text, value)) bad_number(begin);
      return {Token::Kind::number, text, Value(value)};
    }
    return {Token::Kind::number, text, integer(text, 10)};
  }
  // "1if x else 2" is Python.
  [[nodiscard]] bool keyword_follows() const {
    for (const std::string_view word : {"if", "else", "and", "or", "in", "is", "for", "not"}) {
      if (text_.substr(at_, word.size()) == word && !in_name(at(at_ + word.size()))) return true;
    }
    return false;
  }
  Token based(std::size_t begin, int base) {
    at_ += 2;
    std::string text = digits([](char c) { return hex(c) >= 0; });
    for (const char c : text) {
      if (hex(c) >= base) bad_number(begin);
    }
    if (text.empty() || in_name(at(at_))) bad_number(begin);
    return {Token::Kind::number, text, integer(text, base)};
  }
  static Value integer(const std::string& text, int base) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    if (error != std::errc{}) throw ExpressionError(fmt::format("{} needs more than 64 bits", text));
    return Value(value);
  }

  Token string(bool raw, bool format) {
    const char quote = text_[at_];
    const bool triple = at(at_ + 1) == quote && at(at_ + 2) == quote;
    const std::string end(triple ? 3 : 1, quote);
    at_ += end.size();
    std::string out;
    while (text_.substr(at_, end.size()) != end) {
      if (at_ >= text_.size())
        throw ExpressionError(fmt::format("the string {}{} has no closing quote", quote, out));
      if (text_[at_] != '\\' || at_ + 1 >= text_.size()) {
        out += text_[at_++];
      } else if (raw) {
        out += text_.substr(at_, 2);
        at_ += 2;
      } else {
        escape(out);
      }
    }
    at_ += end.size();
    return {format ? Token::Kind::format : Token::Kind::string, out, {}};
  }

  void escape(std::string& out) {
    const char c = text_[at_ + 1];
    at_ += 2;
    static constexpr std::string_view kFrom = "abfnrtv\\'\"", kTo = "\a\b\f\n\r\t\v\\'\"";
    if (const std::size_t known = kFrom.find(c); known != std::string_view::npos) {
      out += kTo[known];
    } else if (c == '\n') {
      return;
    } else if (c >= '0' && c <= '7') {
      char32_t code = static_cast<char32_t>(c - '0');
      for (int i = 0; i < 2 && at(at_) >= '0' && at(at_) <= '7'; ++i)
        code = code * 8 + static_cast<char32_t>(text_[at_++] - '0');
      append_utf8(out, code);
    } else if (c == 'x' || c == 'u' || c == 'U') {
      char32_t code = 0;
      for (int i = 0; i < (c == 'x' ? 2 : c == 'u' ? 4 : 8); ++i, ++at_) {
        if (hex(at(at_)) < 0) throw ExpressionError(fmt::format("'\\{}' needs more digits", c));
        code = code * 16 + static_cast<char32_t>(hex(text_[at_]));
      }
      if (code > 0x10FFFF || (code >= 0xD800 && code < 0xE000))
        throw ExpressionError(fmt::format("'\\{}' is no character", c));
      append_utf8(out, code);
    } else {
      out += '\\';
      out += c;
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

std::vector<Token> tokenise(std::string_view text) {
  return Tokeniser(text).all();
}

}  // namespace doppel
