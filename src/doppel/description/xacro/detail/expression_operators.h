#pragma once
// Python's operators on values. All throw ExpressionError where Python raises.

#include "doppel/description/xacro/detail/expression_parser.h"

namespace doppel {

Value unary_operation(Operator op, const Value& operand);
Value binary_operation(Operator op, const Value& a, const Value& b);
bool compare_values(Operator op, const Value& a, const Value& b);
// a < b, for sorting.
bool value_less(const Value& a, const Value& b);
Value index_value(const Value& object, const Value& key);
// The stored value of object[key] or object.key; null where it has to be computed, or does not exist.
const Value* find_index(const Value& object, const Value& key);
const Value* find_attribute(const Value& object, const Value& key);
// The function of a string, list, dict or set by this name that takes no named arguments, or null.
using Method = Value (*)(const Value& object, const ValueList& arguments);
Method find_method(const Value& object, std::string_view name);
// None stands for an absent bound.
Value slice_value(const Value& object, const Value& from, const Value& to, const Value& step);
// The text of `format % value`.
std::string percent_format(const std::string& format, const Value& value);
// "..." .format(...)
std::string brace_format(const std::string& format, const ValueList& arguments,
                         const KeywordArguments& keywords);

// Items of anything that Python iterates over; throws for what it does not.
ValueList items_of(const Value& value);

}  // namespace doppel
