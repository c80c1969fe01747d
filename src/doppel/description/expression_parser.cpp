#include "doppel/description/expression_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <set>

#include "doppel/description/expression.h"

namespace doppel {
namespace {

constexpr int kDeepest = 100;

struct Token {
  enum class Kind { number, string, name, symbol, end } kind = Kind::end;
  std::string text;
  Value value;
};

bool starts_name(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_';
}
bool in_name(char c) {
  return starts_name(c) || std::isdigit(static_cast<unsigned char>(c)) != 0;
}

class Tokeniser {
 public:
  explicit Tokeniser(std::string_view text) : text_(text) {}

  std::vector<Token> all() {
    std::vector<Token> out;
    while (true) {
      while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
      if (at_ >= text_.size()) break;
      out.push_back(next());
    }
    out.push_back({});
    return out;
  }

 private:
  Token next() {
    const char c = text_[at_];
    const bool digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    const bool point =
        c == '.' && at_ + 1 < text_.size() && std::isdigit(static_cast<unsigned char>(text_[at_ + 1])) != 0;
    if (digit || point) return number();
    if (c == '\'' || c == '"') return string(false);
    if ((c == 'r' || c == 'R') && at_ + 1 < text_.size() &&
        (text_[at_ + 1] == '\'' || text_[at_ + 1] == '"')) {
      ++at_;
      return string(true);
    }
    if (starts_name(c)) {
      const std::size_t begin = at_;
      while (at_ < text_.size() && in_name(text_[at_])) ++at_;
      return {Token::Kind::name, std::string(text_.substr(begin, at_ - begin)), {}};
    }
    static constexpr std::array<std::string_view, 28> kSymbols{
        "**", "//", "==", "!=", "<=", ">=", "<<", ">>", "+", "-", "*", "/", "%", "<",
        ">",  "(",  ")",  "[",  "]",  "{",  "}",  ",",  ":", ".", "|", "&", "^", "~"};
    for (const std::string_view symbol : kSymbols) {
      if (text_.substr(at_, symbol.size()) == symbol) {
        at_ += symbol.size();
        return {Token::Kind::symbol, std::string(symbol), {}};
      }
    }
    if (c == '=') {
      ++at_;
      return {Token::Kind::symbol, "=", {}};
    }
    throw ExpressionError(fmt::format("'{}' has no meaning at column {} of '{}'", c, at_ + 1, text_));
  }

  Token number() {
    const std::size_t begin = at_;
    if (text_.substr(at_, 2) == "0x" || text_.substr(at_, 2) == "0X") {
      at_ += 2;
      std::int64_t value = 0;
      const auto result = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value, 16);
      at_ = static_cast<std::size_t>(result.ptr - text_.data());
      return {Token::Kind::number, std::string(text_.substr(begin, at_ - begin)), Value(value)};
    }
    double real = 0;
    const auto result = std::from_chars(text_.data() + at_, text_.data() + text_.size(), real);
    at_ = static_cast<std::size_t>(result.ptr - text_.data());
    const std::string text(text_.substr(begin, at_ - begin));
    std::int64_t whole = 0;
    const auto as_int = std::from_chars(text.data(), text.data() + text.size(), whole);
    const bool integer = as_int.ec == std::errc{} && as_int.ptr == text.data() + text.size();
    return {Token::Kind::number, text, integer ? Value(whole) : Value(real)};
  }

  Token string(bool raw) {
    const char quote = text_[at_++];
    std::string out;
    for (; at_ < text_.size() && text_[at_] != quote; ++at_) {
      if (raw || text_[at_] != '\\' || at_ + 1 >= text_.size()) {
        out += text_[at_];
        continue;
      }
      const char c = text_[++at_];
      if (c == 'n')
        out += '\n';
      else if (c == 't')
        out += '\t';
      else if (c == '\\' || c == '\'' || c == '"')
        out += c;
      else
        out += std::string("\\") + c;
    }
    if (at_ >= text_.size())
      throw ExpressionError(fmt::format("the string {}{} has no closing quote", quote, out));
    ++at_;
    return {Token::Kind::string, out, Value(out)};
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

// Recursive descent over Python's grammar of expressions, loosest binding first.
class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text), tokens_(Tokeniser(text).all()) {}

  Expression whole() {
    Expression out = expression_list();
    if (peek().kind != Token::Kind::end) fail(fmt::format("'{}' was not expected", peek().text));
    return out;
  }

 private:
  using Kind = Expression::Kind;

  struct Depth {
    explicit Depth(int& d) : depth(d) {
      if (++depth > kDeepest) throw ExpressionError("the expression is nested too deeply");
    }
    ~Depth() { --depth; }
    int& depth;
  };

  [[noreturn]] void fail(const std::string& why) const {
    throw ExpressionError(fmt::format("{} in '{}'", why, text_));
  }
  [[nodiscard]] const Token& peek() const { return tokens_[at_]; }
  [[nodiscard]] bool at(std::string_view text) const {
    return (peek().kind == Token::Kind::symbol || peek().kind == Token::Kind::name) && peek().text == text;
  }
  bool take(std::string_view text) {
    if (!at(text)) return false;
    ++at_;
    return true;
  }
  void expect(std::string_view text) {
    if (!take(text))
      fail(peek().kind == Token::Kind::end
               ? fmt::format("a '{}' is missing at the end", text)
               : fmt::format("'{}' stands where '{}' was expected", peek().text, text));
  }
  static Expression make(Kind kind, std::string text, std::vector<Expression> parts) {
    Expression out;
    out.kind = kind;
    out.text = std::move(text);
    out.parts = std::move(parts);
    return out;
  }

  Expression expression_list() {
    Expression first = ternary();
    if (!at(",")) return first;
    std::vector<Expression> parts{std::move(first)};
    while (take(",")) {
      if (peek().kind == Token::Kind::end || at(")") || at("]")) break;
      parts.push_back(ternary());
    }
    return make(Kind::tuple, "", std::move(parts));
  }

  Expression ternary() {
    const Depth depth(depth_);
    Expression value = logic_or();
    if (!take("if")) return value;
    Expression condition = logic_or();
    expect("else");
    Expression otherwise = ternary();
    return make(Kind::ternary, "", {std::move(condition), std::move(value), std::move(otherwise)});
  }

  Expression logic_or() {
    Expression left = logic_and();
    while (take("or")) left = make(Kind::logic_or, "or", {std::move(left), logic_and()});
    return left;
  }
  Expression logic_and() {
    Expression left = logic_not();
    while (take("and")) left = make(Kind::logic_and, "and", {std::move(left), logic_not()});
    return left;
  }
  Expression logic_not() {
    const Depth depth(depth_);
    if (take("not")) return make(Kind::logic_not, "not", {logic_not()});
    return comparison();
  }

  std::string comparison_operator() {
    for (const char* symbol : {"==", "!=", "<=", ">=", "<", ">", "in"}) {
      if (take(symbol)) return symbol;
    }
    if (take("is")) return take("not") ? "is not" : "is";
    if (at("not") && tokens_[at_ + 1].text == "in") {
      at_ += 2;
      return "not in";
    }
    return "";
  }

  Expression comparison() {
    Expression left = binary(0);
    std::string op = comparison_operator();
    if (op.empty()) return left;
    Expression out = make(Kind::compare, "", {std::move(left)});
    for (; !op.empty(); op = comparison_operator()) {
      out.keywords.push_back(op);
      out.parts.push_back(binary(0));
    }
    return out;
  }

  Expression binary(std::size_t level) {
    static const std::vector<std::vector<std::string_view>> kLevels{
        {"|"}, {"^"}, {"&"}, {"<<", ">>"}, {"+", "-"}, {"*", "//", "/", "%"}};
    if (level == kLevels.size()) return unary();
    Expression left = binary(level + 1);
    while (peek().kind == Token::Kind::symbol) {
      const auto& operators = kLevels[level];
      if (std::find(operators.begin(), operators.end(), peek().text) == operators.end()) break;
      const std::string op = tokens_[at_++].text;
      left = make(Kind::binary, op, {std::move(left), binary(level + 1)});
    }
    return left;
  }

  Expression unary() {
    const Depth depth(depth_);
    for (const char* symbol : {"-", "+", "~"}) {
      if (take(symbol)) return make(Kind::unary, symbol, {unary()});
    }
    Expression base = postfix();
    if (take("**")) return make(Kind::binary, "**", {std::move(base), unary()});
    return base;
  }

  Expression postfix() {
    Expression out = atom();
    while (true) {
      if (take("(")) {
        out = call(std::move(out));
      } else if (take("[")) {
        out = subscript(std::move(out));
      } else if (take(".")) {
        if (peek().kind != Token::Kind::name) fail("a name has to follow '.'");
        out = make(Kind::attribute, tokens_[at_++].text, {std::move(out)});
      } else {
        return out;
      }
    }
  }

  Expression call(Expression function) {
    Expression out = make(Kind::call, "", {std::move(function)});
    while (!take(")")) {
      if (peek().kind == Token::Kind::name && tokens_[at_ + 1].text == "=" &&
          tokens_[at_ + 1].kind == Token::Kind::symbol) {
        out.keywords.push_back(peek().text);
        at_ += 2;
        out.parts.push_back(ternary());
      } else {
        if (!out.keywords.empty()) fail("a positional argument follows a named one");
        Expression argument = ternary();
        if (at("for")) argument = comprehension("list", {std::move(argument)});
        out.parts.push_back(std::move(argument));
      }
      if (!take(",") && !at(")")) expect(")");
    }
    return out;
  }

  Expression subscript(Expression object) {
    const auto bound = [this] { return at(":") || at("]") ? Expression{} : expression_list(); };
    Expression first = bound();
    if (take("]")) return make(Kind::index, "", {std::move(object), std::move(first)});
    expect(":");
    Expression to = bound(), step;
    if (take(":")) step = bound();
    expect("]");
    return make(Kind::slice, "", {std::move(object), std::move(first), std::move(to), std::move(step)});
  }

  Expression comprehension(std::string makes, std::vector<Expression> element) {
    Expression out = make(Kind::comprehension, std::move(makes), std::move(element));
    expect("for");
    const bool bracket = take("(");
    do {
      if (peek().kind != Token::Kind::name) fail("'for' needs a name");
      out.keywords.push_back(tokens_[at_++].text);
    } while (take(","));
    if (bracket) expect(")");
    expect("in");
    out.parts.push_back(logic_or());
    while (take("if")) out.parts.push_back(logic_or());
    return out;
  }

  Expression list_display() {
    if (take("]")) return make(Kind::list, "", {});
    std::vector<Expression> parts{ternary()};
    if (at("for")) {
      Expression out = comprehension("list", std::move(parts));
      expect("]");
      return out;
    }
    while (take(",")) {
      if (at("]")) break;
      parts.push_back(ternary());
    }
    expect("]");
    return make(Kind::list, "", std::move(parts));
  }

  Expression dict_display() {
    std::vector<Expression> parts;
    while (!take("}")) {
      parts.push_back(ternary());
      expect(":");
      parts.push_back(ternary());
      if (at("for") && parts.size() == 2) {
        Expression out = comprehension("dict", std::move(parts));
        expect("}");
        return out;
      }
      if (!take(",") && !at("}")) expect("}");
    }
    return make(Kind::dict, "", std::move(parts));
  }

  Expression parenthesised() {
    if (take(")")) return make(Kind::tuple, "", {});
    Expression out = expression_list();
    if (at("for")) out = comprehension("list", {std::move(out)});
    expect(")");
    return out;
  }

  Expression atom() {
    const Depth depth(depth_);
    const Token token = peek();
    Expression out;
    switch (token.kind) {
      case Token::Kind::number:
        out.value = token.value;
        ++at_;
        return out;
      case Token::Kind::string: {
        std::string text;
        while (peek().kind == Token::Kind::string) text += tokens_[at_++].text;
        out.value = Value(text);
        return out;
      }
      case Token::Kind::name:
        return name();
      case Token::Kind::symbol:
        if (take("(")) return parenthesised();
        if (take("[")) return list_display();
        if (take("{")) return dict_display();
        fail(fmt::format("'{}' was not expected", token.text));
      case Token::Kind::end:
        break;
    }
    fail(text_.find_first_not_of(" \t\r\n") == std::string::npos ? "there is nothing" : "it ends too early");
  }

  Expression name() {
    static const std::set<std::string_view> kKeywords{"if",  "else", "for", "in",    "is",
                                                      "and", "or",   "not", "lambda"};
    Expression out;
    const std::string text = tokens_[at_++].text;
    if (kKeywords.contains(text)) fail(fmt::format("'{}' was not expected", text));
    if (text == "True" || text == "False")
      out.value = Value(text == "True");
    else if (text != "None")
      out = make(Kind::name, text, {});
    return out;
  }

  std::string_view text_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

Expression parse_expression(std::string_view text) {
  return Parser(text).whole();
}

}  // namespace doppel
