#pragma once
// Shared by the tables of functions: checked access to arguments.

#include <functional>
#include <map>

#include "doppel/description/xacro/detail/expression.h"

namespace doppel {

using Arguments = ValueList;
using FunctionTable = std::map<std::string, Value, std::less<>>;

// A module as a value: its functions and constants by name.
class Module : public ValueObject {
 public:
  explicit Module(FunctionTable table) : table_(std::move(table)) {}
  const Value* find(std::string_view name) override {
    const auto found = table_.find(name);
    return found == table_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] std::vector<std::string> names() const override {
    std::vector<std::string> out;
    for (const auto& [name, value] : table_) out.push_back(name);
    return out;
  }

 private:
  FunctionTable table_;
};

double real_argument(const Arguments& a, std::size_t i, const char* function);
std::int64_t integer_argument(const Arguments& a, std::size_t i, const char* function);
const std::string& text_argument(const Arguments& a, std::size_t i, const char* function);
ValueList items_argument(const Arguments& a, std::size_t i, const char* function);
// Throws for too few or too many arguments.
void expect_arguments(const Arguments& a, std::size_t least, std::size_t most, const char* function);
void add_function(FunctionTable& table, const char* name, std::function<Value(const Arguments&)> f);
// f(arguments...)
Value call_value(const Value& function, ValueList arguments);
// A double without a fraction as an int; throws where it needs more than 64 bits.
Value to_integer(double value, const char* function);

FunctionTable math_functions();
// sorted(items, key=None, reverse=False)
Value sorted_values(ValueList items, const KeywordArguments& keywords);

}  // namespace doppel
