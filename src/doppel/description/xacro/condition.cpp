#include "doppel/description/xacro/condition.h"

#include <fmt/format.h>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/xacro/detail/expression.h"
#include "doppel/description/xacro/detail/xacro.h"
#include "doppel/description/xacro/detail/xacro_yaml.h"

namespace doppel {
namespace {

constexpr std::int64_t kMaxConditionSteps = 1'000'000;

class OneName : public NameScope {
 public:
  OneName(std::string_view name, const Value& value) : name_(name), value_(value) {}
  const Value* find(std::string_view name) override { return name == name_ ? &value_ : nullptr; }
  [[nodiscard]] std::vector<std::string> names() const override { return {std::string(name_)}; }

 private:
  std::string_view name_;
  const Value& value_;
};

[[noreturn]] void refuse_condition(const std::string& expression, const ExpressionError& error) {
  throw InputError("condition", {}, fmt::format("the condition '{}': {}", excerpt(expression), error.what()),
                   "write it as in Python, for example m.position[0] > 0.5");
}

}  // namespace

struct Condition::Impl {
  std::string text, name;
  ExpressionStore store;
  const Expression* expression = nullptr;
};

Condition::Condition(std::string expression, std::string name) : impl_(std::make_unique<Impl>()) {
  impl_->text = std::move(expression);
  impl_->name = std::move(name);
  try {
    impl_->expression = parse_expression(impl_->text, impl_->store);
  } catch (const ExpressionError& error) {
    refuse_condition(impl_->text, error);
  }
}

Condition::~Condition() = default;

bool Condition::holds(const std::string& yaml) const {
  const Value value = xacro::dotted(xacro::parse_yaml(yaml, impl_->name, {}));
  OneName scope(impl_->name, value);
  std::int64_t budget = kMaxConditionSteps;
  try {
    return evaluate(*impl_->expression, scope, budget).truth();
  } catch (const ExpressionError& error) {
    refuse_condition(impl_->text, error);
  }
}

}  // namespace doppel
