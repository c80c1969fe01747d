#pragma once
// The tree of an expression.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/value.h"

namespace doppel {

struct Expression {
  enum class Kind {
    constant,
    name,
    list,
    tuple,
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
    comprehension
  };
  Kind kind = Kind::constant;
  std::string text;  // a name, an operator, an attribute
  Value value;       // of a constant
  // Operands in order. dict: key, value, key, value. call: function, arguments; `keywords` names the last
  // ones. slice: object, from, to, step (constants None where absent). ternary: condition, then, else.
  // comprehension: element (and value, of a dict), iterable, conditions; `keywords` holds the loop's names,
  // `text` what it makes: "list", "dict".
  std::vector<Expression> parts;
  std::vector<std::string> keywords;  // also compare's operators
};

// Throws ExpressionError with what was expected.
Expression parse_expression(std::string_view text);

}  // namespace doppel
