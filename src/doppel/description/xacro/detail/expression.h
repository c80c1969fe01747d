#pragma once
// The Python-like expressions of ${...}: a tokeniser and a parser that build a tree, and an evaluator
// over it, without file, network or process access, bounded in depth, steps and size. Source: The Python
// Language Reference, chapter 6 (expressions).

#include <deque>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/arena.h"
#include "doppel/description/xacro/detail/value.h"

namespace doppel {

// The fault of an expression; the caller adds the place.
class ExpressionError : public std::runtime_error {
 public:
  explicit ExpressionError(const std::string& what, std::string kind = "xacro.expression")
      : std::runtime_error(what), rule(std::move(kind)) {}
  std::string rule;
};

// An expression as an error shows it: the beginning, where it is long.
std::string excerpt(std::string_view expression);

// Looks up names; null: unknown. A look-up may evaluate (xacro's properties are lazy). A value that was found
// must neither move nor change until the evaluation that uses it ends, because it is not copied.
class NameScope {
 public:
  virtual ~NameScope() = default;
  virtual const Value* find(std::string_view name) = 0;
  [[nodiscard]] virtual std::vector<std::string> names() const = 0;
  // A lambda was made that looks names up here, now and later.
  virtual void retain() {}
};

struct Expression;
// Owns the trees of expressions and the constants in them. Lambdas refer to their trees, so that a store has
// to outlive the values that came out of its expressions.
class ExpressionStore {
 public:
  [[nodiscard]] Arena& arena() { return arena_; }
  template <class T>
  [[nodiscard]] const Value* keep(T&& value) {
    return &values_.emplace_back(std::forward<T>(value));
  }

 private:
  Arena arena_;
  std::deque<Value> values_;
};
// Throws ExpressionError with what was expected. Immutable, so it can be evaluated many times; `text` is not
// referred to afterwards.
const Expression* parse_expression(std::string_view text, ExpressionStore& store);

// Names that are not in `scope` are looked up among the built-in ones. Throws ExpressionError. `budget`
// counts steps down across calls; at zero evaluation stops with an error. Lambdas keep references to all of
// the arguments, except for `text`, whose tree they keep alive.
Value evaluate(const Expression& expression, NameScope& scope, std::int64_t& budget);
Value evaluate(std::string_view text, NameScope& scope, std::int64_t& budget);

// The names that are available in every expression of xacro: those of math and some of Python's built-ins;
// the modules `math` and `python` (with more built-ins).
const Value* find_builtin(std::string_view name);
std::vector<std::string> builtin_names();

// Attributes and methods: str.split, dict.get, and a dotted dict's entries. Throws ExpressionError.
Value get_attribute(const Value& object, std::string_view name);

// Python's format(value, spec).
std::string format_value(const Value& value, std::string_view spec);

// Detects that too much of the stack is used for a deeper recursion; expressions, properties, macros and includes
// nest within each other, so a single limit on depth is not enough.
class StackGuard {
 public:
  StackGuard();  // the outermost one on a thread marks where its stack begins
  ~StackGuard();
  StackGuard(const StackGuard&) = delete;
  StackGuard& operator=(const StackGuard&) = delete;
  static bool exhausted();

 private:
  bool outermost_;
};

}  // namespace doppel
