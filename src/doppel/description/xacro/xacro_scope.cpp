// Properties and macros by name.
#include <fmt/format.h>

#include "doppel/base/core/names.h"
#include "doppel/description/xacro/detail/xacro.h"

namespace doppel::xacro {
namespace {

// A namespace's properties as attributes: ${arm.length}.
class Space : public ValueObject {
 public:
  explicit Space(Scope& scope) : scope_(scope) {}
  const Value* find(std::string_view name) override { return scope_.find(name); }
  [[nodiscard]] std::vector<std::string> names() const override { return scope_.names(); }

 private:
  Scope& scope_;
};

}  // namespace

std::shared_ptr<const Macro> MacroTable::find(std::string_view name) const {
  const std::uint32_t hash = text_hash(name);
  for (const MacroTable* at = this; at != nullptr; at = at->parent_) {
    if (const auto* const found = at->macros_.find(name, hash)) return *found;
  }
  return nullptr;
}

MacroTable* MacroTable::find_namespace(std::string_view name) const {
  const std::uint32_t hash = text_hash(name);
  for (const MacroTable* at = this; at != nullptr; at = at->parent_) {
    if (const auto* const found = at->namespaces_.find(name, hash)) return found->get();
  }
  return nullptr;
}

void MacroTable::names(std::vector<std::string>& out) const {
  for (const auto& entry : macros_.entries()) out.emplace_back(entry.name);
  for (const auto& entry : namespaces_.entries()) {
    std::vector<std::string> below;
    entry.value->names(below);
    for (const std::string& macro : below) out.push_back(std::string(entry.name) + "." + macro);
  }
  if (parent_ != nullptr) parent_->names(out);
}

const Value* Scope::find(std::string_view name) {
  const std::uint32_t hash = text_hash(name);
  for (Scope* at = this; at != nullptr; at = at->parent_) {
    Property* const found = at->properties_.find(name, hash);
    if (found != nullptr) return found->lazy ? &at->resolved(name, *found) : &found->value;
  }
  return interpreter_.global(name, hash);
}

const Value& Scope::resolved(std::string_view name, Property& property) {
  if (property.busy) {
    throw ExpressionError(fmt::format("the property '{}', defined at {}, depends on itself", name,
                                      locate(property.where).place()),
                          "xacro.circular");
  }
  property.busy = true;
  try {
    property.value = interpreted(interpreter_.text(property.text, *this, property.where));
  } catch (const InputError& error) {
    property.busy = false;
    Diagnostic located = error.diagnostics().front();
    const TreePlace& use = interpreter_.here();
    if (!located.where.within && use.known())
      located.where.within = std::make_shared<SourceLocation::Within>(
          SourceLocation::Within{locate(use), fmt::format("in property '{}'", name)});
    throw InputError(located);
  }
  property.busy = property.lazy = false;
  return property.value;
}

std::vector<std::string> Scope::names() const {
  std::vector<std::string> out = parent_ == nullptr ? std::vector<std::string>{"xacro"} : parent_->names();
  for (const auto& entry : properties_.entries()) {
    if (!entry.erased) out.emplace_back(entry.name);
  }
  return out;
}

void Scope::retain() {
  for (Scope* at = this; at != nullptr; at = at->parent_) at->retained_ = true;
}

bool Scope::knows(std::string_view name) const {
  const std::uint32_t hash = text_hash(name);
  for (const Scope* at = this; at != nullptr; at = at->parent_) {
    if (at->properties_.find(name, hash) != nullptr) return true;
  }
  return interpreter_.global(name, hash) != nullptr || find_builtin(name) != nullptr;
}

void Scope::put(std::string_view name, Property property) {
  interpreter_.warn_of_global(name);
  properties_.set(name, std::move(property));
}

void Scope::set_text(std::string_view name, std::string_view text, const TreePlace& where) {
  // Quotes are removed now, and their content is read again at the first use: '5' becomes a number.
  if (text.size() >= 2 && text.front() == '\'' && text.back() == '\'') text = text.substr(1, text.size() - 2);
  if (text.find('$') != std::string_view::npos)
    put(name, {Value(), text, where, true, false});
  else
    put(name, {literal(text), {}, where, false, false});
}

void Scope::set(std::string_view name, Value value) {
  put(name, {interpreted(std::move(value)), {}, {}, false, false});
}

void Scope::set_literal(std::string_view name, std::string_view text) {
  put(name, {literal(text), {}, {}, false, false});
}

void Scope::remove(std::string_view name) {
  for (Scope* at = this; at != nullptr; at = at->parent_) at->properties_.erase(name);
}

const Block* Scope::find_block(std::string_view stars, std::string_view name) const {
  const std::string whole = std::string(stars).append(name);
  for (const Scope* at = this; at != nullptr; at = at->parent_) {
    if (const Block* const found = at->blocks_.find(whole)) return found;
  }
  return nullptr;
}

void Scope::add_namespace(std::string_view name, std::shared_ptr<Scope> inner) {
  inner->retain();  // the value below refers to it and to the scopes around it
  properties_.set(name,
                  {Value::object(std::string(name), std::make_shared<Space>(*inner)), {}, {}, false, false});
  if (auto* const known = namespaces_.find(name)) old_namespaces_.push_back(*known);
  namespaces_.set(name, std::move(inner));
}

Scope* Scope::find_namespace(std::string_view name) const {
  for (const Scope* at = this; at != nullptr; at = at->parent_) {
    if (const auto* const found = at->namespaces_.find(name)) return found->get();
  }
  return nullptr;
}

}  // namespace doppel::xacro
