#include <fmt/format.h>

#include <charconv>

#include "doppel/core/names.h"
#include "doppel/description/urdf_reader.h"
#include "doppel/description/xacro_detail.h"

namespace doppel::xacro {

Value literal(const std::string& text) {
  if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'')
    return Value(text.substr(1, text.size() - 2));
  if (text.find('_') != std::string::npos || text.empty()) return Value(text);
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return Value(text);
  std::string trimmed = text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
  if (trimmed.starts_with('+')) trimmed.erase(0, 1);
  std::int64_t whole = 0;
  const auto [end, error] = std::from_chars(trimmed.data(), trimmed.data() + trimmed.size(), whole);
  if (error == std::errc{} && end == trimmed.data() + trimmed.size()) return Value(whole);
  if (const auto real = parse_number(trimmed)) return Value(*real);
  if (text == "true" || text == "True") return Value(true);
  if (text == "false" || text == "False") return Value(false);
  return Value(text);
}

std::optional<Value> Scope::find(const std::string& name) {
  if (const auto found = properties_.find(name); found != properties_.end()) {
    Property& property = found->second;
    if (!property.lazy) return property.value;
    if (property.busy) {
      throw ExpressionError(fmt::format("the property '{}' is defined by itself", name), "xacro.circular");
    }
    property.busy = true;
    try {
      const Value value = interpreter_.text(property.text, *this, property.where);
      property.value = value.is<std::string>() ? literal(value.as<std::string>()) : value;
    } catch (...) {
      property.busy = false;
      throw;
    }
    property.busy = property.lazy = false;
    return property.value;
  }
  if (const auto inner = namespaces_.find(name); inner != namespaces_.end()) return inner->second->as_value();
  return parent_ == nullptr ? std::nullopt : parent_->find(name);
}

Value Scope::as_value() {
  ValueDict out;
  std::vector<std::string> own;
  for (const auto& [name, property] : properties_) own.push_back(name);
  for (const std::string& name : own) out.emplace_back(Value(name), *find(name));
  for (const auto& [name, inner] : namespaces_) out.emplace_back(Value(name), inner->as_value());
  return Value::dict(std::move(out));
}

std::vector<std::string> Scope::names() const {
  std::vector<std::string> out = parent_ == nullptr ? std::vector<std::string>{} : parent_->names();
  for (const auto& [name, property] : properties_) out.push_back(name);
  for (const auto& [name, inner] : namespaces_) out.push_back(name);
  return out;
}

bool Scope::knows(const std::string& name) const {
  return properties_.contains(name) || (parent_ != nullptr && parent_->knows(name));
}

void Scope::set_text(const std::string& name, const std::string& text, const SourceLocation& where) {
  const Value value = literal(text);
  properties_[name] = {text, value, value.is<std::string>() && value.as<std::string>() == text, false, where};
}

void Scope::set(const std::string& name, Value value) {
  if (value.is<std::string>()) value = literal(value.as<std::string>());
  properties_[name] = {"", std::move(value), false, false, {}};
}

const Scope::Block* Scope::find_block(const std::string& name) const {
  if (const auto found = blocks_.find(name); found != blocks_.end()) return &found->second;
  return parent_ == nullptr ? nullptr : parent_->find_block(name);
}

std::shared_ptr<const Macro> Scope::find_macro(const std::string& name) const {
  if (const auto found = macros_.find(name); found != macros_.end()) return found->second;
  if (const std::size_t dot = name.find('.'); dot != std::string::npos) {
    const auto inner = namespaces_.find(name.substr(0, dot));
    if (inner != namespaces_.end()) return inner->second->find_macro(name.substr(dot + 1));
  }
  return parent_ == nullptr ? nullptr : parent_->find_macro(name);
}

void Scope::macro_names(std::vector<std::string>& out) const {
  for (const auto& [name, macro] : macros_) out.push_back(name);
  for (const auto& [name, inner] : namespaces_) {
    std::vector<std::string> below;
    inner->macro_names(below);
    for (const std::string& macro : below) out.push_back(name + "." + macro);
  }
  if (parent_ != nullptr) parent_->macro_names(out);
}

}  // namespace doppel::xacro
