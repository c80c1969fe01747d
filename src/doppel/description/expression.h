#pragma once
// The Python-like expressions of ${...}: a tokeniser and parser of our own that make a tree, and an evaluator
// over it, without file, network or process access, bounded in depth and steps. Source: The Python Language
// Reference, chapter 6 (expressions).

#include <functional>
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

// Where names come from; nothing: unknown. May itself evaluate (xacro's properties are lazy).
class NameScope {
 public:
  virtual ~NameScope() = default;
  virtual std::optional<Value> find(const std::string& name) = 0;
  [[nodiscard]] virtual std::vector<std::string> names() const = 0;
};

// Evaluates `text`. Names that `scope` does not know are looked for among Python's built-ins and the math
// module. Throws ExpressionError. `budget` counts steps down across calls; at zero evaluation stops with an
// error.
Value evaluate(std::string_view text, NameScope& scope, std::int64_t& budget);

// math's functions and constants, and the built-ins that xacro allows.
std::optional<Value> find_builtin(const std::string& name);
std::vector<std::string> builtin_names();

// Attributes and methods: str.split, dict.get, and a dict's entries by dot. Throws ExpressionError.
Value get_attribute(const Value& object, const std::string& name);

}  // namespace doppel
