#pragma once
// The Python-like expressions of ${...}: a tokeniser and parser of our own that make a tree, and an evaluator
// over it, without file, network or process access, bounded in depth, steps and size. Source: The Python
// Language Reference, chapter 6 (expressions).

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/value.h"

namespace doppel {

// What is wrong with an expression; the caller adds the place.
class ExpressionError : public std::runtime_error {
 public:
  explicit ExpressionError(const std::string& what, std::string kind = "xacro.expression")
      : std::runtime_error(what), rule(std::move(kind)) {}
  std::string rule;
};

// An expression as an error shows it: the beginning, where it is long.
std::string excerpt(std::string_view expression);

// Where names come from; null: unknown. May itself evaluate (xacro's properties are lazy).
class NameScope {
 public:
  virtual ~NameScope() = default;
  virtual const Value* find(std::string_view name) = 0;
  [[nodiscard]] virtual std::vector<std::string> names() const = 0;
  // A lambda was made that looks names up here, now and later.
  virtual void retain() {}
};

struct Expression;
// Throws ExpressionError with what was expected. Immutable, so it can be kept and evaluated many times.
std::shared_ptr<const Expression> parse_expression(std::string_view text);

struct ExpressionStore {
  std::vector<std::shared_ptr<const Expression>> kept;
};
inline const Expression* parse_expression(std::string_view text, ExpressionStore& store) {
  return store.kept.emplace_back(parse_expression(text)).get();
}

// Names that `scope` does not know are looked for in `builtins`. Throws ExpressionError. `budget` counts
// steps down across calls; at zero evaluation stops with an error. Lambdas keep references to all of the
// arguments.
Value evaluate(const Expression& expression, NameScope& scope, std::int64_t& budget);
Value evaluate(std::string_view text, NameScope& scope, std::int64_t& budget);

// The names that every expression of xacro knows: math's, and some of Python's built-ins; the modules `math`
// and `python` (with more built-ins).
const Value* find_builtin(std::string_view name);
std::vector<std::string> builtin_names();

// Attributes and methods: str.split, dict.get, and a dotted dict's entries. Throws ExpressionError.
Value get_attribute(const Value& object, const std::string& name);

// Python's format(value, spec).
std::string format_value(const Value& value, const std::string& spec);

// Whether the stack is used up so far that nothing should recurse deeper; expressions, properties, macros and
// includes nest within each other, so no single limit on depth would do.
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
