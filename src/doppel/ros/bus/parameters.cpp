#include "doppel/ros/bus/parameters.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "doppel/base/core/names.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel {
namespace {

// rclcpp's.
constexpr std::string_view kTypeNames[] = {"not set",       "bool",         "integer",
                                           "double",        "string",       "bool_array",
                                           "integer_array", "double_array", "string_array"};

std::optional<std::int64_t> parse_integer(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> parse_double(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  double value = std::numeric_limits<double>::infinity();
  if (text == ".nan" || text == ".NaN" || text == ".NAN") return std::numeric_limits<double>::quiet_NaN();
  if (text != ".inf" && text != ".Inf" && text != ".INF") {
    if (text.empty() || std::string_view("0123456789.").find(text[0]) == std::string_view::npos)
      return std::nullopt;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
  }
  return negative ? -value : value;
}

ParameterValue parse_scalar(const YAML::Node& node) {
  const std::string& text = node.Scalar();
  if (node.Tag() == "!") return text;  // quoted
  if (text == "true" || text == "True" || text == "TRUE") return true;
  if (text == "false" || text == "False" || text == "FALSE") return false;
  if (const auto integer = parse_integer(text)) return *integer;
  if (const auto real = parse_double(text)) return *real;
  return text;
}

template <class T>
std::vector<T> all_as(const std::vector<ParameterValue>& values) {
  std::vector<T> result;
  for (const ParameterValue& value : values) {
    if constexpr (std::same_as<T, double>) {
      const auto* integer = std::get_if<std::int64_t>(&value);
      result.push_back(integer != nullptr ? static_cast<double>(*integer) : std::get<double>(value));
    } else {
      result.push_back(std::get<T>(value));
    }
  }
  return result;
}

ParameterValue parse_list(const YAML::Node& node) {
  std::vector<ParameterValue> values;
  for (const auto& item : node) {
    if (!item.IsScalar()) return YAML::Dump(node);
    values.push_back(parse_scalar(item));
  }
  const auto all_are = [&values](auto predicate) { return std::ranges::all_of(values, predicate); };
  const auto is_integer = [](const auto& v) { return std::holds_alternative<std::int64_t>(v); };
  if (values.empty()) return std::vector<std::string>{};
  if (all_are([](const auto& v) { return std::holds_alternative<bool>(v); })) return all_as<bool>(values);
  if (all_are(is_integer)) return all_as<std::int64_t>(values);
  if (all_are([&](const auto& v) { return is_integer(v) || std::holds_alternative<double>(v); })) {
    return all_as<double>(values);
  }
  std::vector<std::string> texts;
  for (const auto& item : node) texts.push_back(item.Scalar());
  return texts;
}

std::string shown(bool value) {
  return value ? "true" : "false";
}
std::string shown(std::int64_t value) {
  return std::to_string(value);
}
std::string shown(double value) {
  const std::string text = shortest_decimal(value);
  if (std::isfinite(value)) return text;
  return value < 0 ? "-.inf" : "." + text;
}
// In a list, text that would be read as another type is quoted.
std::string shown(const std::string& value) {
  const bool plain = value.find_first_of(",[]{}'\":#&*!|>%@` \t\n") == std::string::npos && !value.empty();
  if (plain && std::holds_alternative<std::string>(parse_parameter(value))) return value;
  std::string quoted = "'";
  for (const char c : value) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

template <class T>
bool is_empty_list(const ParameterValue& value) {
  const auto* list = std::get_if<std::vector<T>>(&value);
  return list != nullptr && list->empty();
}

// The value converted to the parameter's type; nullopt: not possible.
std::optional<ParameterValue> converted(const ParameterValue& current, ParameterValue value) {
  if (value.index() == current.index() || std::holds_alternative<std::monostate>(current)) return value;
  if (const auto* integer = std::get_if<std::int64_t>(&value);
      integer && std::holds_alternative<double>(current)) {
    return static_cast<double>(*integer);
  }
  if (std::holds_alternative<std::vector<double>>(current)) {
    if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&value)) {
      return std::vector<double>(integers->begin(), integers->end());
    }
  }
  if (is_empty_list<std::string>(value)) {  // "[]" has no type
    if (std::holds_alternative<std::vector<bool>>(current)) return std::vector<bool>{};
    if (std::holds_alternative<std::vector<std::int64_t>>(current)) return std::vector<std::int64_t>{};
    if (std::holds_alternative<std::vector<double>>(current)) return std::vector<double>{};
  }
  return std::nullopt;
}

std::atomic<std::uint64_t> parameter_changes{0};

void count_change() {
  parameter_changes.fetch_add(1, std::memory_order_relaxed);
}

bool fits_options(const ParameterOptions& options, const ParameterValue& value) {
  if (options.range && !check_range(*options.range, value)) return false;
  return !options.check || options.check(value).ok();
}

}  // namespace

Status check_range(const ParameterRange& range, const ParameterValue& value) {
  double number = range.from;
  if (const auto* real = std::get_if<double>(&value)) number = *real;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) number = static_cast<double>(*whole);
  if (number >= range.from && number <= range.to) return {};
  if (number < range.from) return Status::refused(fmt::format("{:g} is below {:g}", number, range.from));
  return Status::refused(fmt::format("{:g} is above {:g}", number, range.to));
}

std::string_view parameter_type_name(const ParameterValue& value) {
  return kTypeNames[value.index()];
}

std::string to_string(const ParameterValue& value) {
  return std::visit(
      []<class T>(const T& held) -> std::string {
        if constexpr (std::same_as<T, std::monostate>) {
          return "not set";
        } else if constexpr (std::same_as<T, std::string>) {
          return held;
        } else if constexpr (requires { typename T::value_type; }) {
          std::string text = "[";
          for (const auto& element : held) {
            text += text.size() > 1 ? ", " : "";
            text += shown(static_cast<const typename T::value_type&>(element));
          }
          return text + "]";
        } else {
          return shown(held);
        }
      },
      value);
}

ParameterValue parse_parameter(std::string_view text) {
  try {
    const YAML::Node node = YAML::Load(std::string(text));
    if (node.IsScalar()) return parse_scalar(node);
    if (node.IsSequence()) return parse_list(node);
  } catch (const YAML::Exception&) {  // not YAML, so it is plain text
  }
  return std::string(text);
}

ParameterValue Parameters::declare(std::string name, ParameterValue initial, ParameterOptions options) {
  Declared* before = find_mine(name);
  if (before == nullptr) {
    declared_.push_back({std::move(name), std::move(initial), std::move(options)});
    count_change();
    if (on_event_) on_event_({{&declared_.back()}, {}, {}});
    return declared_.back().value;
  }
  if (std::erase(undeclared_, name) == 0)
    throw std::logic_error(fmt::format("parameter '{}' is declared twice", name));
  auto set = converted(initial, before->value);
  const bool fits = set && fits_options(options, *set);
  before->options = std::move(options);
  update_read_only(name, fits ? std::move(*set) : std::move(initial));
  return before->value;
}

const Parameters::Declared* Parameters::find(std::string_view name) const {
  const auto found = std::ranges::find(declared_, name, &Declared::name);
  return found == declared_.end() ? nullptr : &*found;
}

Parameters::Declared* Parameters::find_mine(std::string_view name) {
  const auto found = std::ranges::find(declared_, name, &Declared::name);
  return found == declared_.end() ? nullptr : &*found;
}

// rclcpp's messages, which the tools of ROS 2 show, with further information.
Status Parameters::check(std::string_view name, ParameterValue& value) const {
  const Declared* declared = find(name);
  if (declared == nullptr && allows_undeclared_) return {};
  if (declared == nullptr) {
    return Status::refused(fmt::format("parameter '{}' cannot be set because it was not declared{}", name,
                                       did_you_mean(name, names())));
  }
  if (declared->options.read_only)
    return Status::refused(fmt::format("parameter '{}' cannot be set because it is read-only", name));
  const std::string_view given = parameter_type_name(value);
  auto fitting = declared->options.dynamic_typing ? std::optional(std::move(value))
                                                  : converted(declared->value, std::move(value));
  if (!fitting) {
    return Status::refused(fmt::format(
        "Wrong parameter type, parameter {{{}}} is of type {{{}}}, setting it to {{{}}} is not allowed.",
        name, parameter_type_name(declared->value), given));
  }
  value = std::move(*fitting);
  if (declared->options.range) {
    if (const Status inside = check_range(*declared->options.range, value); !inside) {
      return Status::refused(fmt::format("Parameter {{{}}} doesn't comply with {} range. {}.", name,
                                         std::holds_alternative<double>(value) ? "floating point" : "integer",
                                         inside.why()));
    }
  }
  return declared->options.check ? declared->options.check(value) : Status();
}

Status Parameters::set(std::string_view name, ParameterValue value) {
  std::vector<std::pair<std::string, ParameterValue>> one;
  one.emplace_back(name, std::move(value));
  return set_all(std::move(one));
}

Status Parameters::set_all(std::vector<std::pair<std::string, ParameterValue>> wanted) {
  std::size_t more = 0;
  for (auto& [name, value] : wanted) {
    if (Status fine = check(name, value); !fine) return fine;
    if (find(name) != nullptr) continue;
    if (Status fine = check_undeclared(name, ++more); !fine) return fine;
  }
  Event event;
  std::list<Declared> gone;
  for (const auto& [name, value] : wanted) store(name, value, event, gone);
  for (const auto& [name, value] : wanted) {
    if (std::holds_alternative<std::monostate>(value)) continue;
    for (std::size_t i = 0; i < listeners_.size(); ++i) listeners_[i](name, value);
  }
  if (on_event_ && !wanted.empty()) on_event_(event);
  return {};
}

// Limits the memory that a client on the network can use by setting new names.
Status Parameters::check_undeclared(std::string_view name, std::size_t more) const {
  if (name.empty()) return Status::refused("parameter name must not be empty");
  if (undeclared_.size() + more <= kMaxUndeclared) return {};
  return Status::refused(
      fmt::format("parameter '{}' cannot be set because it was not declared, and there are already {} "
                  "undeclared parameters",
                  name, kMaxUndeclared));
}

void Parameters::store(const std::string& name, const ParameterValue& value, Event& event,
                       std::list<Declared>& gone) {
  count_change();
  const auto found = std::ranges::find(declared_, name, &Declared::name);
  const bool deletes = std::holds_alternative<std::monostate>(value);
  if (found == declared_.end()) {
    if (deletes) return;
    declared_.push_back({name, value, {.dynamic_typing = true}});
    undeclared_.push_back(name);
    event.declared.push_back(&declared_.back());
  } else if (deletes && found->options.dynamic_typing) {
    std::erase(undeclared_, name);
    std::erase(event.declared, &*found);
    std::erase(event.changed, &*found);
    event.deleted.push_back(&*found);
    gone.splice(gone.end(), declared_, found);
  } else {
    found->value = value;
    const auto is_listed = [&found](const auto& list) {
      return std::ranges::find(list, &*found) != list.end();
    };
    if (!is_listed(event.declared) && !is_listed(event.changed)) event.changed.push_back(&*found);
  }
}

void Parameters::update_read_only(std::string_view name, ParameterValue value) {
  Declared* declared = find_mine(name);
  if (declared == nullptr || declared->value == value) return;
  declared->value = std::move(value);
  count_change();
  if (on_event_) on_event_({{}, {declared}, {}});
}

std::uint64_t Parameters::changes() {
  return parameter_changes.load(std::memory_order_relaxed);
}

std::vector<std::string> Parameters::names() const {
  std::vector<std::string> result;
  for (const Declared& declared : declared_) result.push_back(declared.name);
  return result;
}

}  // namespace doppel
