#pragma once
// The tree of an expression, and its tokens.

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "doppel/description/xacro/detail/expression.h"
#include "doppel/description/xacro/detail/value.h"

namespace doppel {

enum class Operator : std::uint8_t {
  none,
  add,
  subtract,
  multiply,
  divide,
  floor_divide,
  modulo,
  power,
  left_shift,
  right_shift,
  bit_and,
  bit_or,
  bit_xor,
  invert,
  equal,
  not_equal,
  less,
  less_equal,
  greater,
  greater_equal,
  in,
  not_in,
  is,
  is_not
};
const char* symbol(Operator op);

struct Loop;

// A node in the arena of a store; so is everything that it refers to.
struct Expression {
  enum class Kind : std::uint8_t {
    constant,
    name,
    list,
    tuple,
    set,
    dict,
    unary,
    binary,
    compare,
    logic_and,
    logic_or,
    logic_not,
    ternary,
    index,
    slice,
    attribute,
    call,
    comprehension,
    lambda,
    starred,
    double_starred,
    format  // of an f-string: texts and fields, joined
  };
  // Fields that few kinds of expressions have.
  struct Rest {
    std::span<const std::string_view> names = {};
    std::span<const Operator> operators = {};  // compare's, one less than parts
    std::span<const Loop> loops = {};
  };
  Kind kind = Kind::constant;
  Operator op = Operator::none;
  char form = 0;  // comprehension: its result, l(ist) s(et) d(ict); format field: its conversion, r or s
  int depth = 1;
  std::string_view text;  // a name, an attribute, a field's format
  const Value* value =
      &kNone;  // of a constant; of a name: the built-in, or null; of an attribute: it as a key
  // Operands in order. dict: key, value, key, value. call: function, arguments; `names` holds a keyword for
  // each argument, "" for a positional one, or nothing where all are positional. slice: object, from, to,
  // step (constants None where absent). ternary: condition, then, else. lambda: body, defaults of the last
  // names. comprehension: element (and value, of a dict); its loops are in `loops`.
  std::span<const Expression* const> parts;
  const Rest* rest = &kNothing;

  static const Value kNone;
  static const Rest kNothing;
};

// A loop's target: a name, or several of them to take an item apart.
struct ExpressionTarget {
  std::string_view name;
  bool starred = false;
  std::span<const ExpressionTarget> parts;
};
struct Loop {
  ExpressionTarget target;
  const Expression* items = nullptr;
  std::span<const Expression* const> conditions;
};

// Operators, brackets, and the keywords of the grammar.
enum class Symbol : std::uint8_t {
  none,
  plus,
  minus,
  star,
  slash,
  double_slash,
  percent,
  double_star,
  shift_left,
  shift_right,
  ampersand,
  bar,
  caret,
  tilde,
  equal,
  not_equal,
  less,
  less_equal,
  greater,
  greater_equal,
  open_round,
  close_round,
  open_square,
  close_square,
  open_curly,
  close_curly,
  comma,
  colon,
  point,
  assign,
  colon_assign,
  arrow,
  key_if,
  key_else,
  key_for,
  key_in,
  key_is,
  key_and,
  key_or,
  key_not,
  key_lambda,
  key_other,  // of statements
  key_true,
  key_false,
  key_none
};
std::string_view spelled(Symbol symbol);

struct Token {
  enum class Kind : std::uint8_t { number, string, format, name, symbol, end };
  Kind kind = Kind::end;
  Symbol symbol = Symbol::none;  // also of a name that is a keyword
  std::string_view text;         // of a string: without quotes and escapes
  const Value* value = nullptr;  // of a number
};

// Tokens, with inline storage for those of a usual expression.
class Tokens {
 public:
  Tokens() {}
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const Token& operator[](std::size_t i) const {
    return i < kInlineTokens ? room_[i] : more_[i - kInlineTokens];
  }
  void add(const Token& token) {
    if (size_ < kInlineTokens)
      std::construct_at(room_ + size_, token);
    else
      more_.push_back(token);
    ++size_;
  }

 private:
  static constexpr std::size_t kInlineTokens = 32;
  union {
    Token room_[kInlineTokens];  // not constructed before it is used
  };
  std::vector<Token> more_;
  std::size_t size_ = 0;
};

// `text` is in the store's arena. Throws ExpressionError.
void tokenise(std::string_view text, ExpressionStore& store, Tokens& out);

}  // namespace doppel
