// Python's lexical rules, as far as expressions need them.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>

#include "doppel/base/core/utf8.h"
#include "doppel/description/xacro/detail/characters.h"
#include "doppel/description/xacro/detail/expression_parser.h"
#include "doppel/description/xacro/detail/powers_of_ten.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxTokens = 20'000;

constexpr bool starts_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
         static_cast<unsigned char>(c) >= 0x80;
}
constexpr auto kInName = [] {
  std::array<bool, 256> out{};
  for (std::size_t c = 0; c < out.size(); ++c)
    out[c] = starts_name(static_cast<char>(c)) || is_digit(static_cast<char>(c));
  return out;
}();
bool in_name(char c) {
  return kInName[static_cast<unsigned char>(c)];
}
int hex(char c) {
  if (is_digit(c)) return c - '0';
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

// The keywords by their first letter; keywords of statements are not names either.
constexpr std::array<std::pair<std::string_view, Symbol>, 30> kKeywords{{
    {"False", Symbol::key_false}, {"None", Symbol::key_none},     {"True", Symbol::key_true},
    {"and", Symbol::key_and},     {"assert", Symbol::key_other},  {"await", Symbol::key_other},
    {"break", Symbol::key_other}, {"class", Symbol::key_other},   {"def", Symbol::key_other},
    {"del", Symbol::key_other},   {"else", Symbol::key_else},     {"except", Symbol::key_other},
    {"for", Symbol::key_for},     {"from", Symbol::key_other},    {"global", Symbol::key_other},
    {"if", Symbol::key_if},       {"import", Symbol::key_other},  {"in", Symbol::key_in},
    {"is", Symbol::key_is},       {"lambda", Symbol::key_lambda}, {"nonlocal", Symbol::key_other},
    {"not", Symbol::key_not},     {"or", Symbol::key_or},         {"pass", Symbol::key_other},
    {"raise", Symbol::key_other}, {"return", Symbol::key_other},  {"try", Symbol::key_other},
    {"while", Symbol::key_other}, {"with", Symbol::key_other},    {"yield", Symbol::key_other},
}};

// The index in the table at which the keywords of each first letter begin.
constexpr auto kFirstKeyword = [] {
  std::array<std::uint8_t, 129> out{};
  for (std::size_t c = 0; c < out.size(); ++c) {
    while (out[c] < kKeywords.size() && static_cast<std::size_t>(kKeywords[out[c]].first[0]) < c) ++out[c];
  }
  return out;
}();

Symbol keyword(std::string_view name) {
  const auto first = static_cast<unsigned char>(name[0]);
  if (first >= 128) return Symbol::none;
  for (std::size_t i = kFirstKeyword[first]; i < kFirstKeyword[first + 1]; ++i) {
    if (kKeywords[i].first == name) return kKeywords[i].second;
  }
  return Symbol::none;
}

class Tokeniser {
 public:
  Tokeniser(std::string_view text, ExpressionStore& store) : text_(text), store_(store) {}

  void all(Tokens& out) {
    while (true) {
      skip();
      if (at_ >= text_.size()) break;
      if (out.size() >= kMaxTokens) throw ExpressionError("the expression is too long");
      out.add(next());
    }
    out.add({});
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
    if (starts_name(c) || c == '\'' || c == '"') return word();
    if (is_digit(c) || (c == '.' && is_digit(at(at_ + 1)))) return number();
    const Symbol found = symbol(c, at(at_ + 1));
    if (found == Symbol::none)
      throw ExpressionError(fmt::format("'{}' has no meaning at column {} of '{}'", c, at_ + 1, text_));
    const std::string_view text = spelled(found);
    at_ += text.size();
    return {Token::Kind::symbol, found, text, nullptr};
  }

  static Symbol symbol(char c, char then) {
    const auto either = [then](char second, Symbol longer, Symbol shorter) {
      return then == second ? longer : shorter;
    };
    switch (c) {
      case '+':
        return Symbol::plus;
      case '-':
        return either('>', Symbol::arrow, Symbol::minus);
      case '*':
        return either('*', Symbol::double_star, Symbol::star);
      case '/':
        return either('/', Symbol::double_slash, Symbol::slash);
      case '<':
        return either('=', Symbol::less_equal, either('<', Symbol::shift_left, Symbol::less));
      case '>':
        return either('=', Symbol::greater_equal, either('>', Symbol::shift_right, Symbol::greater));
      case '=':
        return either('=', Symbol::equal, Symbol::assign);
      case '!':
        return either('=', Symbol::not_equal, Symbol::none);
      case ':':
        return either('=', Symbol::colon_assign, Symbol::colon);
      default:
        return single(c);
    }
  }
  static Symbol single(char c) {
    static constexpr std::string_view kCharacters = "%&|^~()[]{},.";
    static constexpr std::array kSymbols{Symbol::percent,     Symbol::ampersand,   Symbol::bar,
                                         Symbol::caret,       Symbol::tilde,       Symbol::open_round,
                                         Symbol::close_round, Symbol::open_square, Symbol::close_square,
                                         Symbol::open_curly,  Symbol::close_curly, Symbol::comma,
                                         Symbol::point};
    const std::size_t known = kCharacters.find(c);
    return known == std::string_view::npos ? Symbol::none : kSymbols[known];
  }

  // A name, or a string with its prefix.
  Token word() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    const std::string_view prefix = text_.substr(begin, at_ - begin);
    const char quote = at(at_);
    if (prefix.size() > 2 || (quote != '\'' && quote != '"'))
      return {Token::Kind::name, keyword(prefix), prefix, nullptr};
    bool raw = false, format = false;
    for (const char p : prefix) {
      const char lower = static_cast<char>(p | 0x20);
      if (lower != 'r' && lower != 'f' && lower != 'u')
        throw ExpressionError(fmt::format("strings with the prefix '{}' are not supported", prefix));
      raw = raw || lower == 'r';
      format = format || lower == 'f';
    }
    return {format ? Token::Kind::format : Token::Kind::string, Symbol::none, string(raw), nullptr};
  }

  [[noreturn]] void bad_number(std::size_t begin) const {
    std::size_t end = at_;
    while (end < text_.size() && in_name(text_[end])) ++end;
    throw ExpressionError(fmt::format("'{}' is not a number", text_.substr(begin, end - begin)));
  }

  // Skips digits, with single underscores between them.
  template <class Wanted>
  void digits(Wanted wanted) {
    const std::size_t begin = at_;
    while (at_ < text_.size() &&
           (wanted(text_[at_]) || (text_[at_] == '_' && at_ > begin && wanted(at(at_ + 1))))) {
      underscores_ = underscores_ || text_[at_] == '_';
      ++at_;
    }
  }
  // The text since `begin`, without underscores.
  std::string_view number_text(std::size_t begin) {
    const std::string_view text = text_.substr(begin, at_ - begin);
    if (!underscores_) return text;
    std::string out(text);
    std::erase(out, '_');
    return store_.arena().copy(out);
  }
  template <class T>
  Token number_token(std::string_view text, T value) {
    return {Token::Kind::number, Symbol::none, text, store_.keep(value)};
  }

  Token number() {
    const std::size_t begin = at_;
    underscores_ = false;
    if (text_[at_] == '0') {
      for (const auto& [letter, base] : {std::pair{'x', 16}, std::pair{'o', 8}, std::pair{'b', 2}}) {
        if ((at(at_ + 1) | 0x20) == letter) return based(begin, base);
      }
    }
    digits(is_digit);
    bool real = false;
    if (at(at_) == '.') {
      real = true;
      ++at_;
      digits(is_digit);
    }
    const std::size_t sign = at(at_ + 1) == '+' || at(at_ + 1) == '-' ? 1 : 0;
    const bool exponent = (at(at_) | 0x20) == 'e' && is_digit(at(at_ + 1 + sign));
    if (exponent) {
      real = true;
      at_ += 1 + sign;
      digits(is_digit);
    }
    if (in_name(at(at_)) && !keyword_follows()) bad_number(begin);
    const std::string_view text = number_text(begin);
    if (!real) return whole(text);
    double value = 0;
    if ((exponent || !short_real(text, value)) && !parse_real(text, value)) bad_number(begin);
    return number_token(text, value);
  }
  Token whole(std::string_view text) {
    if (text.size() > 1 && text[0] == '0') {
      const std::size_t digit = text.find_first_not_of('0');
      if (digit != std::string_view::npos)
        throw ExpressionError(
            fmt::format("leading zeros in '{}' are not allowed; write {}", text, text.substr(digit)));
    }
    return number_token(text, integer(text, 10));
  }
  // Digits and powers of ten that a double represents exactly give the nearest double by one division.
  static bool short_real(std::string_view text, double& out) {
    if (text.size() > 16) return false;
    std::int64_t digits = 0;
    std::size_t after = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] == '.')
        after = text.size() - i - 1;
      else
        digits = digits * 10 + (text[i] - '0');
    }
    out = static_cast<double>(digits) / kPowersOfTen[after];
    return true;
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
    const std::size_t first = at_;
    digits([](char c) { return hex(c) >= 0; });
    const std::string_view text = number_text(first);
    for (const char c : text) {
      if (hex(c) >= base) bad_number(begin);
    }
    if (text.empty() || in_name(at(at_))) bad_number(begin);
    return number_token(text, integer(text, base));
  }
  static Value integer(std::string_view text, int base) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    if (error == std::errc{}) return Value(value);
    if (auto large = parse_whole(text, base)) return *std::move(large);
    throw ExpressionError(fmt::format("{} needs too many bits", excerpt(text)), "xacro.overflow");
  }

  // The content of the quotes: a view of the text where it has no escapes.
  std::string_view string(bool raw) {
    const char quote = text_[at_];
    const bool triple = at(at_ + 1) == quote && at(at_ + 2) == quote;
    at_ += triple ? 3 : 1;
    const std::size_t begin = at_;
    const auto ends = [&](std::size_t i) {
      return at(i) == quote && i < text_.size() && (!triple || (at(i + 1) == quote && at(i + 2) == quote));
    };
    std::string decoded;
    bool escaped = false;
    while (!ends(at_)) {
      if (at_ >= text_.size())
        throw ExpressionError(fmt::format("the string {}{} has no closing quote", quote,
                                          escaped ? decoded : text_.substr(begin)));
      if (text_[at_] != '\\' || at_ + 1 >= text_.size()) {
        if (escaped) decoded += text_[at_];
        ++at_;
      } else if (raw) {
        at_ += 2;
      } else {
        if (!escaped) decoded = text_.substr(begin, at_ - begin);
        escaped = true;
        escape(decoded);
      }
    }
    const std::string_view out =
        escaped ? store_.arena().copy(std::string_view(decoded)) : text_.substr(begin, at_ - begin);
    at_ += triple ? 3 : 1;
    return out;
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
        throw ExpressionError(fmt::format("'\\{}' is not a character", c));
      append_utf8(out, code);
    } else {
      out += '\\';
      out += c;
    }
  }

  std::string_view text_;
  ExpressionStore& store_;
  std::size_t at_ = 0;
  bool underscores_ = false;  // in the number that is being read
};

}  // namespace

std::string_view spelled(Symbol symbol) {
  static constexpr std::array<std::string_view, 45> kTexts{
      "",   "+",   "-",  "*",   "/",      "//", "%",    "**",    "<<",  ">>",   "&",   "|",
      "^",  "~",   "==", "!=",  "<",      "<=", ">",    ">=",    "(",   ")",    "[",   "]",
      "{",  "}",   ",",  ":",   ".",      "=",  ":=",   "->",    "if",  "else", "for", "in",
      "is", "and", "or", "not", "lambda", "",   "True", "False", "None"};
  return kTexts[static_cast<std::size_t>(symbol)];
}

void tokenise(std::string_view text, ExpressionStore& store, Tokens& out) {
  Tokeniser(text, store).all(out);
}

}  // namespace doppel
