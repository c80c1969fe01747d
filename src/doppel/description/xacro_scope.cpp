// Properties and macros by name.
#include <fmt/format.h>

#include "doppel/core/names.h"
#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {
namespace {

// A namespace's properties as attributes: ${arm.length}.
class Space : public ValueObject {
 public:
  explicit Space(Scope& scope) : scope_(scope) {}
  const Value* find(const std::string& name) override { return scope_.find(name); }
  [[nodiscard]] std::vector<std::string> names() const override { return scope_.names(); }

 private:
  Scope& scope_;
};

}  // namespace

Value literal(const std::string& text) {
  if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'')
    return Value(text.substr(1, text.size() - 2));
  if (text.empty()) return Value(text);
  // Most texts begin unlike a number or a truth value.
  static constexpr std::string_view kBeginnings = "0123456789+-. \t\r\n\v\fiInNtTfF";
  if (kBeginnings.find(text[0]) == std::string_view::npos || text.find('_') != std::string::npos)
    return Value(text);
  std::int64_t whole = 0;
  if (parse_integer(text, whole)) return Value(whole);
  // A whole number of more than 64 bits stays as it is written.
  const std::size_t digits = text[0] == '-' || text[0] == '+' ? 1 : 0;
  if (text.size() > digits + 18 && text.find_first_not_of("0123456789", digits) == std::string::npos)
    return Value(text);
  double real = 0;
  if (parse_real(text, real)) return Value(real);
  if (text == "true" || text == "True") return Value(true);
  if (text == "false" || text == "False") return Value(false);
  return Value(text);
}

std::optional<bool> truth_of(const Value& value) {
  if (!value.is<std::string>()) return value.truth();
  const std::string& text = value.as<std::string>();
  if (text == "true" || text == "True") return true;
  if (text == "false" || text == "False") return false;
  std::int64_t whole = 0;
  if (!parse_integer(text, whole)) return std::nullopt;
  return whole != 0;
}

std::shared_ptr<const Macro> MacroTable::find(const std::string& name) const {
  const auto found = macros_.find(name);
  if (found != macros_.end()) return found->second;
  return parent_ == nullptr ? nullptr : parent_->find(name);
}

MacroTable* MacroTable::find_namespace(const std::string& name) const {
  const auto found = namespaces_.find(name);
  if (found != namespaces_.end()) return found->second.get();
  return parent_ == nullptr ? nullptr : parent_->find_namespace(name);
}

void MacroTable::names(std::vector<std::string>& out) const {
  for (const auto& [name, macro] : macros_) out.push_back(name);
  for (const auto& [name, inner] : namespaces_) {
    std::vector<std::string> below;
    inner->names(below);
    for (const std::string& macro : below) out.push_back(name + "." + macro);
  }
  if (parent_ != nullptr) parent_->names(out);
}

const Value* Scope::find(const std::string& name) {
  for (Scope* at = this; at != nullptr; at = at->parent_) {
    const auto found = at->properties_.find(name);
    if (found == at->properties_.end()) continue;
    return found->second.lazy ? &at->resolved(name, found->second) : &found->second.value;
  }
  return interpreter_.global(name);
}

const Value& Scope::resolved(const std::string& name, Property& property) {
  if (property.busy) {
    throw ExpressionError(
        fmt::format("the property '{}', defined at {}, needs itself", name, property.where.place()),
        "xacro.circular");
  }
  property.busy = true;
  try {
    Value value = interpreter_.text(property.text, *this, property.where);
    property.value = value.is<std::string>() ? literal(value.as<std::string>()) : std::move(value);
  } catch (const InputError& error) {
    property.busy = false;
    Diagnostic told = error.diagnostics().front();
    const SourceLocation& use = interpreter_.here();
    if (!told.where.within && use.known())
      told.where.within = std::make_shared<SourceLocation::Within>(
          SourceLocation::Within{use, fmt::format("in property '{}'", name)});
    throw InputError(told);
  }
  property.busy = property.lazy = false;
  return property.value;
}

std::vector<std::string> Scope::names() const {
  std::vector<std::string> out = parent_ == nullptr ? std::vector<std::string>{"xacro"} : parent_->names();
  for (const auto& [name, property] : properties_) out.push_back(name);
  return out;
}

void Scope::retain() {
  for (Scope* at = this; at != nullptr; at = at->parent_) at->retained_ = true;
}

bool Scope::knows(const std::string& name) const {
  return properties_.contains(name) || (parent_ != nullptr && parent_->knows(name));
}

void Scope::set_text(const std::string& name, const std::string& text, const SourceLocation& where) {
  interpreter_.warn_of_global(name);
  Value value = literal(text);
  // Quotes come off now, and what was in them is read once more at the first use: '5' ends as a number.
  std::string inner = value.is<std::string>() ? value.as<std::string>() : "";
  const bool lazy = inner.find('$') != std::string::npos;
  if (!lazy && value.is<std::string>()) value = literal(inner);
  properties_[name] = {lazy ? std::move(inner) : "", std::move(value), lazy, false, where};
}

void Scope::set(const std::string& name, Value value) {
  interpreter_.warn_of_global(name);
  if (value.is<std::string>()) value = literal(value.as<std::string>());
  properties_[name] = {"", std::move(value), false, false, {}};
}

void Scope::remove(const std::string& name) {
  for (Scope* at = this; at != nullptr; at = at->parent_) at->properties_.erase(name);
}

const Block* Scope::find_block(const std::string& name) const {
  if (const auto found = blocks_.find(name); found != blocks_.end()) return &found->second;
  return parent_ == nullptr ? nullptr : parent_->find_block(name);
}

void Scope::add_namespace(const std::string& name, std::shared_ptr<Scope> inner) {
  inner->retain();  // the value below refers to it and to the scopes around it
  properties_[name] = {"", Value::object(name, std::make_shared<Space>(*inner)), false, false, {}};
  auto& place = namespaces_[name];
  if (place) old_namespaces_.push_back(std::move(place));
  place = std::move(inner);
}

Scope* Scope::find_namespace(const std::string& name) const {
  if (const auto found = namespaces_.find(name); found != namespaces_.end()) return found->second.get();
  return parent_ == nullptr ? nullptr : parent_->find_namespace(name);
}

}  // namespace doppel::xacro
