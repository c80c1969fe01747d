// Recursive descent over Python's grammar of expressions, loosest binding first.
#include "doppel/description/expression_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

namespace doppel {
namespace {

constexpr int kDeepest = 200;
using Kind = Expression::Kind;

constexpr std::array<const char*, 24> kSymbolsOfOperators{
    "",  "+", "-",  "*",  "/", "//", "%", "**", "<<", ">>",     "&",  "|",
    "^", "~", "==", "!=", "<", "<=", ">", ">=", "in", "not in", "is", "is not"};

// How strongly a binary operator binds; 0: it is none.
std::pair<int, Operator> binding(std::string_view text) {
  static constexpr std::array<std::pair<std::string_view, std::pair<int, Operator>>, 11> kTable{{
      {"|", {1, Operator::bit_or}},
      {"^", {2, Operator::bit_xor}},
      {"&", {3, Operator::bit_and}},
      {"<<", {4, Operator::left_shift}},
      {">>", {4, Operator::right_shift}},
      {"+", {5, Operator::add}},
      {"-", {5, Operator::subtract}},
      {"*", {6, Operator::multiply}},
      {"/", {6, Operator::divide}},
      {"//", {6, Operator::floor_divide}},
      {"%", {6, Operator::modulo}},
  }};
  for (const auto& [known, what] : kTable) {
    if (known == text) return what;
  }
  return {0, Operator::none};
}

class Parser {
 public:
  explicit Parser(std::string_view text, int depth = 0)
      : text_(text), tokens_(tokenise(text)), depth_(depth) {}

  Expression whole() {
    Expression out = expression_list();
    if (peek().kind != Token::Kind::end) fail(fmt::format("{} was not expected", told(peek())));
    return out;
  }

 private:
  struct Depth {
    explicit Depth(int& d) : depth(d) {
      if (++depth > kDeepest || StackGuard::exhausted())
        throw ExpressionError("the expression is nested too deeply");
    }
    ~Depth() { --depth; }
    int& depth;
  };

  [[noreturn]] void fail(const std::string& why) const {
    throw ExpressionError(fmt::format("{} in '{}'", why, text_.size() > 200 ? text_.substr(0, 200) : text_));
  }
  static std::string told(const Token& token) {
    return token.kind == Token::Kind::string ? "a string" : "'" + token.text + "'";
  }
  [[nodiscard]] const Token& peek(std::size_t ahead = 0) const {
    return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
  }
  [[nodiscard]] bool at(std::string_view text, std::size_t ahead = 0) const {
    const Token& token = peek(ahead);
    return (token.kind == Token::Kind::symbol || token.kind == Token::Kind::name) && token.text == text;
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
               : fmt::format("{} stands where '{}' was expected", told(peek()), text));
  }

  static Expression make(Kind kind, std::vector<Expression> parts, std::string text = "") {
    Expression out;
    out.kind = kind;
    out.text = std::move(text);
    for (const Expression& part : parts) out.depth = std::max(out.depth, part.depth + 1);
    // A chain such as 1+1+1+... leans to one side, one level for each term.
    if (out.depth > 2 * kDeepest) throw ExpressionError("the expression is nested too deeply");
    out.parts = std::move(parts);
    return out;
  }
  template <class... Parts>
  static Expression join(Kind kind, Parts&&... parts) {
    std::vector<Expression> list;
    list.reserve(sizeof...(parts));
    (list.push_back(std::move(parts)), ...);
    return make(kind, std::move(list));
  }

  [[nodiscard]] bool list_ends() const {
    return peek().kind == Token::Kind::end || at(")") || at("]") || at("}") || at("=") || at(":");
  }
  Expression item() {
    if (take("*")) return join(Kind::starred, binary(1));
    return ternary();
  }
  Expression expression_list() {
    Expression first = item();
    if (!at(",")) {
      if (first.kind == Kind::starred) fail("'*' was not expected");
      return first;
    }
    std::vector<Expression> parts;
    parts.push_back(std::move(first));
    while (take(",")) {
      if (list_ends()) break;
      parts.push_back(item());
    }
    return make(Kind::tuple, std::move(parts));
  }

  Expression ternary() {
    const Depth depth(depth_);
    if (take("lambda")) return lambda();
    Expression value = logic_or();
    if (!take("if")) return value;
    Expression condition = logic_or();
    expect("else");
    Expression otherwise = ternary();
    return join(Kind::ternary, condition, value, otherwise);
  }

  Expression lambda() {
    std::vector<Expression> parts(1);
    std::vector<std::string> names;
    while (!take(":")) {
      if (peek().kind != Token::Kind::name) fail("a lambda needs names");
      names.push_back(tokens_[at_++].text);
      if (take("="))
        parts.push_back(ternary());
      else if (parts.size() > 1)
        fail("a parameter without a default follows one with a default");
      if (!take(",") && !at(":")) expect(":");
    }
    parts[0] = ternary();
    Expression out = make(Kind::lambda, std::move(parts));
    out.names = std::move(names);
    return out;
  }

  Expression logic_or() {
    Expression left = logic_and();
    while (take("or")) {
      Expression right = logic_and();
      left = join(Kind::logic_or, left, right);
    }
    return left;
  }
  Expression logic_and() {
    Expression left = logic_not();
    while (take("and")) {
      Expression right = logic_not();
      left = join(Kind::logic_and, left, right);
    }
    return left;
  }
  Expression logic_not() {
    const Depth depth(depth_);
    if (take("not")) {
      Expression operand = logic_not();
      return join(Kind::logic_not, operand);
    }
    return comparison();
  }

  Operator comparison_operator() {
    static constexpr std::array<std::pair<const char*, Operator>, 7> kTable{{{"==", Operator::equal},
                                                                             {"!=", Operator::not_equal},
                                                                             {"<=", Operator::less_equal},
                                                                             {">=", Operator::greater_equal},
                                                                             {"<", Operator::less},
                                                                             {">", Operator::greater},
                                                                             {"in", Operator::in}}};
    for (const auto& [text, op] : kTable) {
      if (take(text)) return op;
    }
    if (take("is")) return take("not") ? Operator::is_not : Operator::is;
    if (at("not") && at("in", 1)) {
      at_ += 2;
      return Operator::not_in;
    }
    return Operator::none;
  }

  Expression comparison() {
    Expression left = binary(1);
    Operator op = comparison_operator();
    if (op == Operator::none) return left;
    std::vector<Expression> parts;
    std::vector<Operator> operators;
    parts.push_back(std::move(left));
    for (; op != Operator::none; op = comparison_operator()) {
      operators.push_back(op);
      parts.push_back(binary(1));
    }
    Expression out = make(Kind::compare, std::move(parts));
    out.operators = std::move(operators);
    return out;
  }

  Expression binary(int weakest) {
    Expression left = unary();
    while (peek().kind == Token::Kind::symbol) {
      const auto [strength, op] = binding(peek().text);
      if (strength < weakest || strength == 0) break;
      ++at_;
      Expression right = binary(strength + 1);
      left = join(Kind::binary, left, right);
      left.op = op;
    }
    return left;
  }

  Expression unary() {
    const Depth depth(depth_);
    for (const auto& [text, op] : {std::pair{"-", Operator::subtract}, std::pair{"+", Operator::add},
                                   std::pair{"~", Operator::invert}}) {
      if (!take(text)) continue;
      Expression operand = unary();
      Expression out = join(Kind::unary, operand);
      out.op = op;
      return out;
    }
    Expression base = postfix();
    if (!take("**")) return base;
    Expression exponent = unary();
    Expression out = join(Kind::binary, base, exponent);
    out.op = Operator::power;
    return out;
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
        const std::string name = tokens_[at_++].text;
        if (name.starts_with("__")) fail(fmt::format("the name '{}' is not allowed", name));
        out = join(Kind::attribute, out);
        out.text = name;
      } else {
        return out;
      }
    }
  }

  Expression call(Expression function) {
    std::vector<Expression> parts;
    std::vector<std::string> names;
    parts.push_back(std::move(function));
    bool named = false;
    while (!take(")")) {
      std::string name;
      if (take("**")) {
        Expression operand = ternary();
        parts.push_back(join(Kind::double_starred, operand));
        named = true;
      } else if (peek().kind == Token::Kind::name && at("=", 1)) {
        name = peek().text;
        at_ += 2;
        parts.push_back(ternary());
        named = true;
      } else {
        if (named && !at("*")) fail("a positional argument follows a named one");
        Expression argument = item();
        if (at("for")) argument = comprehension('l', std::move(argument));
        parts.push_back(std::move(argument));
      }
      names.push_back(std::move(name));
      if (!take(",") && !at(")")) expect(")");
    }
    Expression out = make(Kind::call, std::move(parts));
    out.names = std::move(names);
    return out;
  }

  Expression subscript(Expression object) {
    const auto bound = [this] { return at(":") || at("]") ? Expression{} : expression_list(); };
    if (at("]")) fail("an index is missing");
    Expression first = bound();
    if (take("]")) return join(Kind::index, object, first);
    expect(":");
    Expression to = bound(), step;
    if (take(":")) step = bound();
    expect("]");
    return join(Kind::slice, object, first, to, step);
  }

  Target target(bool nested) {
    Target out;
    const Depth depth(depth_);
    do {
      if (list_ends() || at("in")) break;
      Target part;
      part.starred = take("*");
      if (take("(") || take("[")) {
        part = target(true);
      } else {
        if (peek().kind != Token::Kind::name) fail("'for' needs a name");
        part.name = tokens_[at_++].text;
      }
      out.parts.push_back(std::move(part));
      if (!at(",") && !nested && out.parts.size() == 1) {
        if (out.parts[0].starred) fail("'*' was not expected");
        Target only = std::move(out.parts[0]);
        return only;
      }
    } while (take(","));
    if (out.parts.empty()) fail("'for' needs a name");
    if (nested && !take(")")) expect("]");
    return out;
  }

  Expression comprehension(char form, Expression element, Expression* value = nullptr) {
    std::vector<Expression> parts;
    parts.push_back(std::move(element));
    if (value != nullptr) parts.push_back(std::move(*value));
    Expression out = make(Kind::comprehension, std::move(parts));
    out.form = form;
    while (take("for")) {
      Expression::Loop loop;
      loop.target = target(false);
      expect("in");
      loop.items = logic_or();
      while (take("if")) loop.conditions.push_back(logic_or());
      out.loops.push_back(std::move(loop));
    }
    return out;
  }

  // What stands between brackets, separated by commas; `parts` holds what was read of it already.
  Expression display(Kind kind, char form, std::string_view close, std::vector<Expression> parts = {}) {
    if (parts.empty() && take(close)) return make(kind, {});
    if (parts.empty()) parts.push_back(item());
    if (at("for")) {
      Expression out = comprehension(form, std::move(parts[0]));
      expect(close);
      return out;
    }
    while (take(",") && !at(close)) parts.push_back(item());
    expect(close);
    return make(kind, std::move(parts));
  }

  Expression braces() {
    if (take("}")) return make(Kind::dict, {});
    std::vector<Expression> parts;
    if (!at("**")) {
      parts.push_back(item());
      if (!at(":")) return display(Kind::set, 's', "}", std::move(parts));
    }
    while (true) {
      if (parts.size() % 2 == 0 && take("**")) {
        Expression operand = binary(1);
        parts.push_back(join(Kind::double_starred, operand));
        parts.emplace_back();
      } else {
        if (parts.size() % 2 == 0) parts.push_back(ternary());
        expect(":");
        parts.push_back(ternary());
      }
      if (at("for") && parts.size() == 2) {
        Expression value = std::move(parts[1]);
        Expression out = comprehension('d', std::move(parts[0]), &value);
        expect("}");
        return out;
      }
      if (!take(",") && !at("}")) expect("}");
      if (take("}")) return make(Kind::dict, std::move(parts));
    }
  }

  Expression parenthesised() {
    if (take(")")) return make(Kind::tuple, {});
    Expression out = expression_list();
    if (at("for")) out = comprehension('l', std::move(out));
    expect(")");
    return out;
  }

  Expression atom() {
    const Depth depth(depth_);
    const Token& token = peek();
    switch (token.kind) {
      case Token::Kind::number: {
        Expression out;
        out.value = token.value;
        ++at_;
        return out;
      }
      case Token::Kind::string:
      case Token::Kind::format:
        return strings();
      case Token::Kind::name:
        return name();
      case Token::Kind::symbol:
        if (take("(")) return parenthesised();
        if (take("[")) return display(Kind::list, 'l', "]");
        if (take("{")) return braces();
        fail(fmt::format("'{}' was not expected", token.text));
      case Token::Kind::end:
        break;
    }
    fail(text_.find_first_not_of(" \t\r\n") == std::string::npos ? "there is nothing" : "it ends too early");
  }

  // Strings one after another are one.
  Expression strings() {
    std::vector<Expression> parts(1);
    std::string plain;
    const auto flush = [&] {
      if (plain.empty()) return;
      parts.emplace_back();
      parts.back().value = Value(std::exchange(plain, ""));
    };
    for (; peek().kind == Token::Kind::string || peek().kind == Token::Kind::format; ++at_) {
      if (peek().kind == Token::Kind::string)
        plain += peek().text;
      else
        format_string(peek().text, plain, parts, flush);
    }
    if (parts.size() == 1) {
      parts[0].value = Value(std::move(plain));
      return std::move(parts[0]);
    }
    flush();
    parts.erase(parts.begin());
    return make(Kind::format, std::move(parts));
  }

  template <class Flush>
  void format_string(const std::string& text, std::string& plain, std::vector<Expression>& parts,
                     const Flush& flush) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool brace = text[i] == '{' || text[i] == '}';
      if (!brace) {
        plain += text[i];
      } else if (i + 1 < text.size() && text[i + 1] == text[i]) {
        plain += text[i++];
      } else {
        const std::size_t end = text[i] == '{' ? text.find('}', i) : std::string::npos;
        if (end == std::string::npos) fail("a brace of the f-string is not closed");
        flush();
        parts.push_back(field(std::string_view(text).substr(i + 1, end - i - 1)));
        i = end;
      }
    }
  }
  Expression field(std::string_view inner) {
    int brackets = 0;
    std::size_t end = 0;
    for (; end < inner.size(); ++end) {
      if (inner[end] == '(' || inner[end] == '[') ++brackets;
      if (inner[end] == ')' || inner[end] == ']') --brackets;
      const bool bang = inner[end] == '!' && inner.substr(end + 1, 1) != "=";
      if (brackets == 0 && (inner[end] == ':' || bang)) break;
    }
    const Depth depth(depth_);
    Expression value = Parser(inner.substr(0, end), depth_).whole();
    Expression out = join(Kind::format, value);
    out.form = 's';
    if (end < inner.size() && inner[end] == '!' && end + 1 < inner.size()) {
      out.form = inner[end + 1];
      end += 2;
    }
    if (end < inner.size() && inner[end] == ':') out.text = std::string(inner.substr(end + 1));
    return out;
  }

  Expression name() {
    static const std::set<std::string_view> kKeywords{
        "if",    "else",   "for",   "in",    "is",     "and",    "or",    "not",    "lambda",
        "await", "yield",  "class", "def",   "return", "import", "from",  "while",  "with",
        "try",   "except", "pass",  "break", "global", "del",    "raise", "assert", "nonlocal"};
    const std::string text = tokens_[at_++].text;
    if (kKeywords.contains(text)) fail(fmt::format("'{}' was not expected", text));
    if (text.starts_with("__")) fail(fmt::format("the name '{}' is not allowed", text));
    Expression out;
    if (text == "True" || text == "False")
      out.value = Value(text == "True");
    else if (text != "None")
      out = make(Kind::name, {}, text);
    return out;
  }

  std::string_view text_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

const char* symbol(Operator op) {
  return kSymbolsOfOperators[static_cast<std::size_t>(op)];
}

std::shared_ptr<const Expression> parse_expression(std::string_view text) {
  const StackGuard guard;
  return std::make_shared<const Expression>(Parser(text).whole());
}

}  // namespace doppel
