#pragma once
// A condition in Python's syntax about one value, by the expressions of xacro: "m.position[0] > 0.5".

#include <memory>
#include <string>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API Condition {
 public:
  // `name`: what the value is called in the expression. Throws InputError where it is not an expression.
  Condition(std::string expression, std::string name);
  ~Condition();
  Condition(const Condition&) = delete;
  Condition& operator=(const Condition&) = delete;

  // True if the condition is true for a value that is given as YAML; its entries are attributes and items.
  // Throws InputError where the expression cannot be evaluated, as for an entry that the value does not have.
  [[nodiscard]] bool holds(const std::string& yaml) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
