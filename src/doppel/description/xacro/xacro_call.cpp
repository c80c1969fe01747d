// Calls of macros.
#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/description/xacro/detail/xacro_expander.h"

namespace doppel::xacro {

// Finds a macro by its whole name first; then through the namespaces in front of it, whose names are visible
// in the call.
std::shared_ptr<const Macro> Expander::resolve_macro(std::string_view name, Context& context) {
  if (auto macro = context.macros->find(name)) return macro;
  std::string_view rest = name;
  for (std::size_t dot = 0; (dot = rest.find('.')) != std::string_view::npos; rest.remove_prefix(dot + 1)) {
    const std::string_view space = rest.substr(0, dot);
    MacroTable* const macros = context.macros->find_namespace(space);
    Scope* const scope = context.scope->find_namespace(space);
    if (macros == nullptr || scope == nullptr) return nullptr;
    context.macros = macros;
    context.scope = scope;
  }
  return rest == name ? nullptr : context.macros->find(rest);
}

void Expander::bind_attributes(Call& call) {
  const std::vector<Macro::Parameter>& parameters = call.macro.parameters;
  for (const TreeAttribute* a = call.node.attributes; a != nullptr; a = a->next) {
    std::size_t which = 0;
    while (which < parameters.size() && (parameters[which].name != a->name || call.bound[which] != 0))
      ++which;
    if (which == parameters.size()) {
      if (a->name == "xacro:name" || (call.through_call && a->name == "macro") ||
          a->name.starts_with("xmlns:"))
        continue;
      std::vector<std::string> names;
      for (const Macro::Parameter& p : parameters) names.emplace_back(p.name);
      throw InputError("xacro.unknown_parameter", location_of(a->where, call.caller),
                       fmt::format("the macro '{}' has no parameter '{}'{}", call.macro.name, a->name,
                                   did_you_mean(a->name, names)),
                       fmt::format("it is defined at {}", locate(call.macro.where).place()));
    }
    call.bound[which] = 1;
    if (a->dollar)
      call.inner.set(a->name, value_of(*a, call.caller));
    else
      call.inner.set_literal(a->name, a->value);
  }
}

void Expander::bind_blocks(Call& call) {
  const std::vector<Macro::Parameter>& parameters = call.macro.parameters;
  if (call.node.first == nullptr &&
      std::none_of(parameters.begin(), parameters.end(), [](const Macro::Parameter& p) { return p.block(); }))
    return;
  Attributes nowhere;
  Output given = make_output(&nowhere);
  children(call.node, call.caller, given);
  const TreeNode* next = given.nodes.first;
  const auto skip = [&next] {
    while (next != nullptr && next->kind != TreeNode::Kind::element) next = next->next;
  };
  skip();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Macro::Parameter& p = parameters[i];
    if (!p.block()) continue;
    if (next == nullptr) {
      throw InputError(
          "xacro.missing_block", location_of(call.node.where, call.caller),
          fmt::format("the macro '{}' needs a block '{}'", call.macro.name, p.name),
          fmt::format("write the element between <{}> and </{}>", call.node.name, call.node.name));
    }
    call.bound[i] = 1;
    call.inner.set_block(p.name, {next, call.caller.within});
    next = next->next;
    skip();
  }
  if (next != nullptr) {
    throw InputError(
        "xacro.unused_block", locate(next->where),
        fmt::format("the macro '{}' has no parameter for the block <{}>", call.macro.name, next->name),
        fmt::format("it is defined at {}", locate(call.macro.where).place()));
  }
}

void Expander::bind_defaults(Call& call) {
  std::vector<std::string> missing;
  const TreePlace where = placed(call.node.where, call.caller);
  for (std::size_t i = 0; i < call.macro.parameters.size(); ++i) {
    const Macro::Parameter& p = call.macro.parameters[i];
    if (call.bound[i] != 0) continue;
    const Value* forwarded = nullptr;
    try {
      if (p.forwards) forwarded = call.caller.scope->find(p.name);
      if (p.forwards && forwarded == nullptr) forwarded = find_builtin(p.name);
    } catch (const ExpressionError& problem) {
      throw InputError(problem.rule, locate(where), problem.what());
    }
    if (forwarded != nullptr)
      call.inner.set(p.name, *forwarded);
    else if (p.fallback)
      call.inner.set(p.name, interpreter_.text(*p.fallback, *call.caller.scope, where));
    else
      missing.emplace_back(p.name);
  }
  if (missing.empty()) return;
  std::string list;
  for (const std::string& name : missing) list += (list.empty() ? "'" : ", '") + name + "'";
  throw InputError(
      "xacro.missing_parameter", locate(where),
      fmt::format("the macro '{}' needs the parameter{} {}", call.macro.name, missing.size() > 1 ? "s" : "",
                  list),
      fmt::format("write {}=\"...\"; it is defined at {}", missing[0], locate(call.macro.where).place()));
}

void Expander::call(const TreeNode& in, std::string_view name, bool through_call, const Context& context,
                    Output& out) {
  Context caller = context;
  const std::shared_ptr<const Macro> macro = resolve_macro(name, caller);
  if (!macro) {
    std::vector<std::string> names;
    context.macros->names(names);
    for (const Command& known : commands()) names.emplace_back(known.name);
    std::sort(names.begin(), names.end());
    throw InputError("xacro.unknown_macro", location_of(in.where, context),
                     fmt::format("unknown macro '{}'{}", name, did_you_mean(name, names)),
                     "macros must be defined or included before they are called");
  }
  Context inside = deeper(in, caller, "in macro", macro->name);
  auto inner = std::make_unique<Scope>(interpreter_, caller.scope, Scope::Kind::macro);
  Call binding{in, *macro, caller, *inner, through_call, std::vector<char>(macro->parameters.size())};
  bind_attributes(binding);
  bind_blocks(binding);
  bind_defaults(binding);
  MacroTable macros(caller.macros);
  inside.scope = inner.get();
  inside.macros = &macros;
  Attributes lifted(macro->element->attributes, true);
  Output made = make_output(&lifted);
  children(*macro->element, inside, made);
  drop_comments(in, out);
  lift_namespaces(lifted.first(), out, context);
  out.nodes.append(made.nodes);
  if (inner->retained()) interpreter_.keep(std::move(inner));
}

void Expander::dynamic_call(const TreeNode& in, const Context& context, Output& out) {
  const TreeAttribute& name = required(in, "macro", context);
  call(in, text_of(name, context), true, context, out);
}

}  // namespace doppel::xacro
