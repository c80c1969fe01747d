// Fuzz target: evaluates any text, with some defined names, within a budget.
#include <cstdint>
#include <map>

#include "doppel/description/xacro/detail/expression.h"

namespace {

class Names : public doppel::NameScope {
 public:
  Names() {
    using doppel::Value;
    doppel::ValueDict dict;
    dict.set("a", Value(std::int64_t{1}));
    dict.set("b", Value::list({Value(1.5), Value("x")}));
    values_ = {{"d", Value::dict(std::move(dict), true)}, {"s", Value("a{}b%s")}, {"x", Value(2.5)}};
  }
  const doppel::Value* find(std::string_view name) override {
    const auto found = values_.find(name);
    return found == values_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] std::vector<std::string> names() const override { return {"d", "s", "x"}; }

 private:
  std::map<std::string, doppel::Value, std::less<>> values_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Names names;
  std::int64_t budget = 20'000;
  try {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    static_cast<void>(doppel::evaluate(text, names, budget).repr());
  } catch (const doppel::ExpressionError&) {
    return 0;
  }
  return 0;
}
