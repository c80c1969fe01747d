#pragma once
// The tree of an expression, and its tokens.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/expression.h"
#include "doppel/description/value.h"

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
  Kind kind = Kind::constant;
  Operator op = Operator::none;
  char form = 0;  // comprehension: what it makes, l(ist) s(et) d(ict); format field: its conversion, r or s
  int depth = 1;
  std::string text;  // a name, an attribute, a field's format
  Value value;       // of a constant
  // Operands in order. dict: key, value, key, value. call: function, arguments; `names` holds a keyword for
  // each argument, "" for a positional one. slice: object, from, to, step (constants None where absent).
  // ternary: condition, then, else. lambda: body, defaults of the last names. comprehension: element (and
  // value, of a dict); its loops stand in `loops`.
  std::vector<Expression> parts;
  std::vector<std::string> names;
  std::vector<Operator> operators;  // compare's, one less than parts
  struct Loop;
  std::vector<Loop> loops;
};

// A loop's target: a name, or several of them to take an item apart.
struct Target {
  std::string name;
  bool starred = false;
  std::vector<Target> parts;
};
struct Expression::Loop {
  Target target;
  Expression items;
  std::vector<Expression> conditions;
};

struct Token {
  enum class Kind : std::uint8_t { number, string, format, name, symbol, end };
  Kind kind = Kind::end;
  std::string text;
  Value value;
};
// Throws ExpressionError.
std::vector<Token> tokenise(std::string_view text);

}  // namespace doppel
