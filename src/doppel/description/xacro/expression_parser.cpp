// Precedence climbing and recursive descent over Python's grammar of expressions.
#include "doppel/description/xacro/detail/expression_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace doppel {
namespace {

constexpr int kMaxExpressionDepth = 200;
using Kind = Expression::Kind;
using Node = const Expression*;

const Value kTrue(true), kFalse(false);

// The precedence of the symbol between two operands; 0: not an operator.
enum Precedence : std::uint8_t { kNothing, kOr, kAnd, kNot, kComparison, kBinary };
struct Binding {
  std::uint8_t precedence = kNothing;
  Operator op = Operator::none;
};
constexpr auto kBindings = [] {
  std::array<Binding, 45> out{};
  const auto set = [&out](Symbol symbol, int precedence, Operator op) {
    out[static_cast<std::size_t>(symbol)] = {static_cast<std::uint8_t>(precedence), op};
  };
  set(Symbol::key_or, kOr, Operator::none);
  set(Symbol::key_and, kAnd, Operator::none);
  set(Symbol::equal, kComparison, Operator::equal);
  set(Symbol::not_equal, kComparison, Operator::not_equal);
  set(Symbol::less, kComparison, Operator::less);
  set(Symbol::less_equal, kComparison, Operator::less_equal);
  set(Symbol::greater, kComparison, Operator::greater);
  set(Symbol::greater_equal, kComparison, Operator::greater_equal);
  set(Symbol::key_in, kComparison, Operator::in);
  set(Symbol::key_is, kComparison, Operator::is);
  set(Symbol::key_not, kComparison, Operator::not_in);  // with an "in" behind it
  set(Symbol::bar, kBinary, Operator::bit_or);
  set(Symbol::caret, kBinary + 1, Operator::bit_xor);
  set(Symbol::ampersand, kBinary + 2, Operator::bit_and);
  set(Symbol::shift_left, kBinary + 3, Operator::left_shift);
  set(Symbol::shift_right, kBinary + 3, Operator::right_shift);
  set(Symbol::plus, kBinary + 4, Operator::add);
  set(Symbol::minus, kBinary + 4, Operator::subtract);
  set(Symbol::star, kBinary + 5, Operator::multiply);
  set(Symbol::slash, kBinary + 5, Operator::divide);
  set(Symbol::double_slash, kBinary + 5, Operator::floor_divide);
  set(Symbol::percent, kBinary + 5, Operator::modulo);
  return out;
}();

class Parser {
 public:
  // `text` is in the store's arena.
  Parser(std::string_view text, ExpressionStore& store, int depth = 0)
      : text_(text), store_(store), arena_(store.arena()), depth_(depth) {
    tokenise(text, store, tokens_);
  }

  Node whole() {
    Node out = expression_list();
    if (peek().kind != Token::Kind::end) fail(fmt::format("unexpected {}", token_text(peek())));
    return out;
  }

 private:
  struct Depth {
    explicit Depth(int& d) : depth(d) {
      if (++depth > kMaxExpressionDepth) throw ExpressionError("the expression is nested too deeply");
    }
    ~Depth() { --depth; }
    Depth(const Depth&) = delete;
    Depth& operator=(const Depth&) = delete;
    int& depth;
  };
  // Collects operands until they are copied into the arena together.
  class Gathered {
   public:
    explicit Gathered(std::vector<Node>& all) : all_(all), begin_(all.size()) {}
    ~Gathered() { all_.resize(begin_); }
    Gathered(const Gathered&) = delete;
    Gathered& operator=(const Gathered&) = delete;
    void add(Node node) { all_.push_back(node); }
    [[nodiscard]] std::size_t size() const { return all_.size() - begin_; }
    [[nodiscard]] std::span<const Node> nodes() const { return std::span(all_).subspan(begin_); }

   private:
    std::vector<Node>& all_;
    std::size_t begin_;
  };

  [[noreturn]] void fail(const std::string& why) const {
    throw ExpressionError(fmt::format("{} in '{}'", why, text_.substr(0, 200)));
  }
  [[noreturn]] void not_expected(std::string_view text) const { fail(fmt::format("unexpected '{}'", text)); }
  static std::string token_text(const Token& token) {
    return token.kind == Token::Kind::string ? "a string" : fmt::format("'{}'", token.text);
  }
  [[nodiscard]] const Token& peek() const { return tokens_[at_]; }  // the end is never passed
  [[nodiscard]] bool at(Symbol symbol) const { return peek().symbol == symbol; }
  [[nodiscard]] bool then(Symbol symbol) const {
    return at_ + 1 < tokens_.size() && tokens_[at_ + 1].symbol == symbol;
  }
  bool take(Symbol symbol) {
    if (!at(symbol)) return false;
    ++at_;
    return true;
  }
  void expect(Symbol symbol) {
    if (take(symbol)) return;
    fail(peek().kind == Token::Kind::end
             ? fmt::format("a '{}' is missing at the end", spelled(symbol))
             : fmt::format("expected '{1}', found {0}", token_text(peek()), spelled(symbol)));
  }
  std::string_view name_or(const char* why) {
    if (peek().kind != Token::Kind::name) fail(why);
    return tokens_[at_++].text;
  }

  Expression* make(Kind kind, std::span<const Node> parts) {
    auto* out = arena_.make<Expression>();
    out->kind = kind;
    for (const Node part : parts) out->depth = std::max(out->depth, part->depth + 1);
    // A chain such as 1+1+1+... is a tree with one level for each term.
    if (out->depth > 2 * kMaxExpressionDepth) throw ExpressionError("the expression is nested too deeply");
    out->parts = arena_.copy(parts);
    return out;
  }
  template <class... Parts>
  Expression* join(Kind kind, Parts... parts) {
    const std::array<Node, sizeof...(parts)> list{parts...};
    return make(kind, list);
  }
  Expression* operated(Kind kind, Operator op, std::span<const Node> parts) {
    Expression* out = make(kind, parts);
    out->op = op;
    return out;
  }
  Expression* constant(const Value* value) {
    auto* out = arena_.make<Expression>();
    out->value = value;
    return out;
  }
  template <class T>
  std::span<const T> kept(const std::vector<T>& list) {
    return arena_.copy(std::span<const T>(list));
  }

  [[nodiscard]] bool list_ends() const {
    return peek().kind == Token::Kind::end || at(Symbol::close_round) || at(Symbol::close_square) ||
           at(Symbol::close_curly) || at(Symbol::assign) || at(Symbol::colon);
  }
  Node item() {
    if (take(Symbol::star)) return join(Kind::starred, operation(kBinary));
    return ternary();
  }
  Node expression_list() {
    Node first = item();
    if (!at(Symbol::comma)) {
      if (first->kind == Kind::starred) not_expected("*");
      return first;
    }
    Gathered parts(gathered_);
    parts.add(first);
    while (take(Symbol::comma)) {
      if (list_ends()) break;
      parts.add(item());
    }
    return make(Kind::tuple, parts.nodes());
  }

  Node ternary() {
    const Depth depth(depth_);
    if (StackGuard::exhausted()) throw ExpressionError("the expression is nested too deeply");
    if (take(Symbol::key_lambda)) return lambda();
    Node value = logic();
    if (!take(Symbol::key_if)) return value;
    Node condition = logic();
    expect(Symbol::key_else);
    Node otherwise = ternary();
    return join(Kind::ternary, condition, value, otherwise);
  }

  Node lambda() {
    Gathered parts(gathered_);
    parts.add(nullptr);  // the body, which comes last
    std::vector<std::string_view> names;
    while (!take(Symbol::colon)) {
      names.push_back(name_or("a lambda needs names"));
      if (take(Symbol::assign))
        parts.add(ternary());
      else if (parts.size() > 1)
        fail("a parameter without a default follows one with a default");
      if (!take(Symbol::comma) && !at(Symbol::colon)) expect(Symbol::colon);
    }
    std::vector<Node> all(parts.nodes().begin(), parts.nodes().end());
    all[0] = ternary();
    Expression* out = make(Kind::lambda, all);
    out->rest = arena_.make<Expression::Rest>(kept(names));
    return out;
  }

  Node logic() {
    const Depth depth(depth_);
    return operation(kOr);
  }

  // Operands and the operators between them, of at least the precedence `weakest`.
  Node operation(int weakest) {
    Node left = weakest <= kNot && at(Symbol::key_not) ? negation() : unary();
    while (true) {
      const Symbol symbol = peek().symbol;
      const Binding found = kBindings[static_cast<std::size_t>(symbol)];
      if (found.precedence < weakest) return left;
      if (found.precedence == kComparison) {
        if (symbol == Symbol::key_not && !then(Symbol::key_in)) return left;
        left = comparison(left);
        continue;
      }
      ++at_;
      const std::array<Node, 2> both{left, operation(found.precedence + 1)};
      const Kind kind = found.precedence == kOr    ? Kind::logic_or
                        : found.precedence == kAnd ? Kind::logic_and
                                                   : Kind::binary;
      left = operated(kind, found.op, both);
    }
  }
  Node negation() {
    ++at_;
    const Depth depth(depth_);
    return join(Kind::logic_not, operation(kNot));
  }

  Operator comparison_operator() {
    const Symbol symbol = peek().symbol;
    const Binding found = kBindings[static_cast<std::size_t>(symbol)];
    if (found.precedence != kComparison) return Operator::none;
    if (symbol == Symbol::key_not && !then(Symbol::key_in)) return Operator::none;
    at_ += symbol == Symbol::key_not ? 2 : 1;
    return symbol == Symbol::key_is && take(Symbol::key_not) ? Operator::is_not : found.op;
  }
  Node comparison(Node left) {
    Gathered parts(gathered_);
    std::vector<Operator> operators;
    parts.add(left);
    for (Operator op; (op = comparison_operator()) != Operator::none;) {
      operators.push_back(op);
      parts.add(operation(kBinary));
    }
    Expression* out = make(Kind::compare, parts.nodes());
    out->rest = arena_.make<Expression::Rest>(std::span<const std::string_view>(), kept(operators));
    return out;
  }

  Node unary() {
    const Depth depth(depth_);
    const Symbol symbol = peek().symbol;
    if (symbol == Symbol::minus || symbol == Symbol::plus || symbol == Symbol::tilde) {
      ++at_;
      const std::array<Node, 1> operand{unary()};
      return operated(Kind::unary,
                      symbol == Symbol::minus  ? Operator::subtract
                      : symbol == Symbol::plus ? Operator::add
                                               : Operator::invert,
                      operand);
    }
    Node base = postfix();
    if (!take(Symbol::double_star)) return base;
    const std::array<Node, 2> both{base, unary()};
    return operated(Kind::binary, Operator::power, both);
  }

  Node postfix() {
    Node out = atom();
    while (true) {
      switch (peek().symbol) {
        case Symbol::open_round:
          ++at_;
          out = call(out);
          break;
        case Symbol::open_square:
          ++at_;
          out = subscript(out);
          break;
        case Symbol::point:
          ++at_;
          out = attribute(out);
          break;
        default:
          return out;
      }
    }
  }
  Node attribute(Node object) {
    const std::string_view name = name_or("a name must follow '.'");
    if (name.starts_with("__")) fail(fmt::format("the name '{}' is not allowed", name));
    Expression* out = join(Kind::attribute, object);
    out->text = name;
    out->value = store_.keep(std::string(name));
    return out;
  }

  Node call(Node function) {
    Gathered parts(gathered_);
    std::vector<std::string_view> names;  // empty while all arguments are positional
    parts.add(function);
    bool named = false;
    while (!take(Symbol::close_round)) {
      std::string_view name;
      if (take(Symbol::double_star)) {
        parts.add(join(Kind::double_starred, ternary()));
        named = true;
      } else if (peek().kind == Token::Kind::name && then(Symbol::assign)) {
        name = peek().text;
        at_ += 2;
        parts.add(ternary());
        named = true;
      } else {
        if (named && !at(Symbol::star)) fail("a positional argument follows a named one");
        Node argument = item();
        parts.add(at(Symbol::key_for) ? comprehension('l', argument) : argument);
      }
      if (named) {
        names.resize(parts.size() - 2);  // those before are positional
        names.push_back(name);
      }
      if (!take(Symbol::comma) && !at(Symbol::close_round)) expect(Symbol::close_round);
    }
    Expression* out = make(Kind::call, parts.nodes());
    if (named) out->rest = arena_.make<Expression::Rest>(kept(names));
    return out;
  }

  Node bound() {
    return at(Symbol::colon) || at(Symbol::close_square) ? constant(&Expression::kNone) : expression_list();
  }
  Node subscript(Node object) {
    if (at(Symbol::close_square)) fail("an index is missing");
    Node first = bound();
    if (take(Symbol::close_square)) return join(Kind::index, object, first);
    expect(Symbol::colon);
    Node to = bound();
    Node step = take(Symbol::colon) ? bound() : constant(&Expression::kNone);
    expect(Symbol::close_square);
    return join(Kind::slice, object, first, to, step);
  }

  ExpressionTarget target(bool nested) {
    const Depth depth(depth_);
    std::vector<ExpressionTarget> parts;
    do {
      if (list_ends() || at(Symbol::key_in)) break;
      ExpressionTarget part;
      part.starred = take(Symbol::star);
      if (take(Symbol::open_round) || take(Symbol::open_square))
        part = target(true);
      else
        part.name = name_or("'for' needs a name");
      parts.push_back(part);
      if (!at(Symbol::comma) && !nested && parts.size() == 1) {
        if (part.starred) not_expected("*");
        return part;
      }
    } while (take(Symbol::comma));
    if (parts.empty()) fail("'for' needs a name");
    if (nested && !take(Symbol::close_round)) expect(Symbol::close_square);
    return {{}, false, kept(parts)};
  }

  Node comprehension(char form, Node element, Node value = nullptr) {
    Expression* out =
        value == nullptr ? join(Kind::comprehension, element) : join(Kind::comprehension, element, value);
    out->form = form;
    std::vector<Loop> loops;
    while (take(Symbol::key_for)) {
      Loop loop;
      loop.target = target(false);
      expect(Symbol::key_in);
      loop.items = logic();
      std::vector<Node> conditions;
      while (take(Symbol::key_if)) conditions.push_back(logic());
      loop.conditions = kept(conditions);
      loops.push_back(loop);
    }
    out->rest = arena_.make<Expression::Rest>(std::span<const std::string_view>(),
                                              std::span<const Operator>(), kept(loops));
    return out;
  }

  // The items between brackets, separated by commas; `first` was read already, or is null.
  Node display(Kind kind, char form, Symbol close, Node first = nullptr) {
    if (first == nullptr && take(close)) return make(kind, {});
    if (first == nullptr) first = item();
    if (at(Symbol::key_for)) {
      Node out = comprehension(form, first);
      expect(close);
      return out;
    }
    Gathered parts(gathered_);
    parts.add(first);
    while (take(Symbol::comma) && !at(close)) parts.add(item());
    expect(close);
    return make(kind, parts.nodes());
  }

  Node braces() {
    if (take(Symbol::close_curly)) return make(Kind::dict, {});
    Node key = nullptr;
    if (!at(Symbol::double_star)) {
      key = item();
      if (!at(Symbol::colon)) return display(Kind::set, 's', Symbol::close_curly, key);
    }
    Gathered parts(gathered_);
    while (true) {
      if (key == nullptr && take(Symbol::double_star)) {
        parts.add(join(Kind::double_starred, operation(kBinary)));
        parts.add(constant(&Expression::kNone));
      } else {
        parts.add(key == nullptr ? ternary() : key);
        expect(Symbol::colon);
        parts.add(ternary());
      }
      key = nullptr;
      if (at(Symbol::key_for) && parts.size() == 2) {
        Node out = comprehension('d', parts.nodes()[0], parts.nodes()[1]);
        expect(Symbol::close_curly);
        return out;
      }
      if (!take(Symbol::comma) && !at(Symbol::close_curly)) expect(Symbol::close_curly);
      if (take(Symbol::close_curly)) return make(Kind::dict, parts.nodes());
    }
  }

  Node parenthesised() {
    if (take(Symbol::close_round)) return make(Kind::tuple, {});
    Node out = expression_list();
    if (at(Symbol::key_for)) out = comprehension('l', out);
    expect(Symbol::close_round);
    return out;
  }

  Node atom() {
    const Depth depth(depth_);
    const Token& token = peek();
    switch (token.kind) {
      case Token::Kind::number:
        ++at_;
        return constant(token.value);
      case Token::Kind::name:
        return name();
      case Token::Kind::string:
      case Token::Kind::format:
        return strings();
      case Token::Kind::symbol:
        if (take(Symbol::open_round)) return parenthesised();
        if (take(Symbol::open_square)) return display(Kind::list, 'l', Symbol::close_square);
        if (take(Symbol::open_curly)) return braces();
        not_expected(token.text);
      case Token::Kind::end:
        break;
    }
    fail(text_.find_first_not_of(" \t\r\n") == std::string_view::npos ? "the expression is empty"
                                                                      : "it is incomplete");
  }

  Node text_constant(std::string text) { return constant(store_.keep(std::move(text))); }

  // Adjacent strings are concatenated.
  Node strings() {
    Gathered parts(gathered_);
    std::string plain;
    for (; peek().kind == Token::Kind::string || peek().kind == Token::Kind::format; ++at_) {
      if (peek().kind == Token::Kind::string)
        plain += peek().text;
      else
        format_string(peek().text, plain, parts);
    }
    if (parts.size() == 0) return text_constant(std::move(plain));
    if (!plain.empty()) parts.add(text_constant(std::move(plain)));
    return make(Kind::format, parts.nodes());
  }

  void format_string(std::string_view text, std::string& plain, Gathered& parts) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool brace = text[i] == '{' || text[i] == '}';
      if (!brace) {
        plain += text[i];
      } else if (i + 1 < text.size() && text[i + 1] == text[i]) {
        plain += text[i++];
      } else {
        const std::size_t end = text[i] == '{' ? text.find('}', i) : std::string_view::npos;
        if (end == std::string_view::npos) fail("a brace of the f-string is not closed");
        if (!plain.empty()) parts.add(text_constant(std::exchange(plain, "")));
        parts.add(field(text.substr(i + 1, end - i - 1)));
        i = end;
      }
    }
  }
  Node field(std::string_view inner) {
    int brackets = 0;
    std::size_t end = 0;
    for (; end < inner.size(); ++end) {
      if (inner[end] == '(' || inner[end] == '[') ++brackets;
      if (inner[end] == ')' || inner[end] == ']') --brackets;
      const bool bang = inner[end] == '!' && inner.substr(end + 1, 1) != "=";
      if (brackets == 0 && (inner[end] == ':' || bang)) break;
    }
    const Depth depth(depth_);
    Expression* out = join(Kind::format, Parser(inner.substr(0, end), store_, depth_).whole());
    out->form = 's';
    if (end < inner.size() && inner[end] == '!' && end + 1 < inner.size()) {
      out->form = inner[end + 1];
      end += 2;
    }
    if (end < inner.size() && inner[end] == ':') out->text = inner.substr(end + 1);
    return out;
  }

  Node name() {
    const Token& token = tokens_[at_++];
    switch (token.symbol) {
      case Symbol::none:
        break;
      case Symbol::key_true:
        return constant(&kTrue);
      case Symbol::key_false:
        return constant(&kFalse);
      case Symbol::key_none:
        return constant(&Expression::kNone);
      default:
        not_expected(token.text);
    }
    if (token.text.starts_with("__")) fail(fmt::format("the name '{}' is not allowed", token.text));
    auto* out = arena_.make<Expression>();
    out->kind = Kind::name;
    out->text = token.text;
    out->value = find_builtin(token.text);
    return out;
  }

  std::string_view text_;
  ExpressionStore& store_;
  Arena& arena_;
  Tokens tokens_;
  std::vector<Node> gathered_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

const Value Expression::kNone;
const Expression::Rest Expression::kNothing;

const char* symbol(Operator op) {
  static constexpr std::array<const char*, 24> kTexts{
      "",  "+", "-",  "*",  "/", "//", "%", "**", "<<", ">>",     "&",  "|",
      "^", "~", "==", "!=", "<", "<=", ">", ">=", "in", "not in", "is", "is not"};
  return kTexts[static_cast<std::size_t>(op)];
}

const Expression* parse_expression(std::string_view text, ExpressionStore& store) {
  const StackGuard guard;
  return Parser(store.arena().copy(text), store).whole();
}

}  // namespace doppel
