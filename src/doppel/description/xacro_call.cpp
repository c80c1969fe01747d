// Calls of macros.
#include <fmt/format.h>

#include <algorithm>

#include "doppel/core/names.h"
#include "doppel/description/xacro_expander.h"

namespace doppel::xacro {

// By its whole name first; then through the namespaces in front of it, whose names the call then sees.
std::shared_ptr<const Macro> Expander::resolve_macro(const std::string& name, Context& context) const {
  if (auto macro = context.macros->find(name)) return macro;
  std::string rest = name;
  for (std::size_t dot; (dot = rest.find('.')) != std::string::npos; rest.erase(0, dot + 1)) {
    const std::string space = rest.substr(0, dot);
    MacroTable* const macros = context.macros->find_namespace(space);
    Scope* const scope = context.scope->find_namespace(space);
    if (macros == nullptr || scope == nullptr) return nullptr;
    context.macros = macros;
    context.scope = scope;
  }
  return rest == name ? nullptr : context.macros->find(rest);
}

void Expander::bind_attributes(Call& call) {
  for (const XmlAttribute& a : call.node.attributes) {
    const auto wanted = std::find(call.open.begin(), call.open.end(), a.name);
    if (wanted == call.open.end()) {
      if (a.name == "xacro:name" || (call.through_call && a.name == "macro") || a.name.starts_with("xmlns:"))
        continue;
      std::vector<std::string> names;
      for (const Macro::Parameter& p : call.macro.parameters) names.push_back(p.name);
      throw InputError("xacro.unknown_parameter", placed(a.where, call.caller),
                       fmt::format("the macro '{}' has no parameter '{}'{}", call.macro.name, a.name,
                                   did_you_mean(a.name, names)),
                       fmt::format("it is defined at {}", call.macro.where.place()));
    }
    call.open.erase(wanted);
    call.inner.set(a.name, value_of(a, call.caller));
  }
}

void Expander::bind_blocks(Call& call) {
  if (call.node.children.empty() && std::none_of(call.macro.parameters.begin(), call.macro.parameters.end(),
                                                 [](const Macro::Parameter& p) { return p.block(); }))
    return;
  std::vector<XmlAttribute> nowhere;
  Output given = make_output(&nowhere);
  children(call.node, call.caller, given);
  std::erase_if(given.nodes, [](const XmlNode& n) { return n.kind != XmlNode::Kind::element; });
  std::size_t next = 0;
  for (const Macro::Parameter& p : call.macro.parameters) {
    if (!p.block()) continue;
    if (next >= given.nodes.size()) {
      throw InputError(
          "xacro.missing_block", placed(call.node.where, call.caller),
          fmt::format("the macro '{}' needs a block '{}'", call.macro.name, p.name),
          fmt::format("write the element between <{}> and </{}>", call.node.name, call.node.name));
    }
    std::erase(call.open, p.name);
    auto block = std::make_shared<const XmlNode>(std::move(given.nodes[next++]));
    call.inner.set_block(p.name, {std::move(block), call.caller.within});
  }
  if (next < given.nodes.size()) {
    throw InputError(
        "xacro.unused_block", given.nodes[next].where,
        fmt::format("the macro '{}' has no use for the block <{}>", call.macro.name, given.nodes[next].name),
        fmt::format("it is defined at {}", call.macro.where.place()));
  }
}

void Expander::bind_defaults(Call& call) {
  std::vector<std::string> missing;
  const SourceLocation where = placed(call.node.where, call.caller);
  for (const Macro::Parameter& p : call.macro.parameters) {
    if (std::find(call.open.begin(), call.open.end(), p.name) == call.open.end()) continue;
    const Value* forwarded = nullptr;
    try {
      if (p.forwards) forwarded = call.caller.scope->find(p.name);
    } catch (const ExpressionError& problem) {
      throw InputError(problem.rule, where, problem.what());
    }
    if (forwarded != nullptr)
      call.inner.set(p.name, *forwarded);
    else if (p.fallback)
      call.inner.set(p.name, interpreter_.text(*p.fallback, *call.caller.scope, where));
    else
      missing.push_back(p.name);
  }
  if (missing.empty()) return;
  std::string list;
  for (const std::string& name : missing) list += (list.empty() ? "'" : ", '") + name + "'";
  throw InputError(
      "xacro.missing_parameter", where,
      fmt::format("the macro '{}' needs the parameter{} {}", call.macro.name, missing.size() > 1 ? "s" : "",
                  list),
      fmt::format("write {}=\"...\"; it is defined at {}", missing[0], call.macro.where.place()));
}

void Expander::call(const Child& child, const std::string& name, bool through_call, const Context& context,
                    Output& out) {
  const XmlNode& in = child.node;
  Context caller = context;
  const std::shared_ptr<const Macro> macro = resolve_macro(name, caller);
  if (!macro) {
    std::vector<std::string> names;
    context.macros->names(names);
    for (const auto& [known, handler] : handlers()) names.push_back(known);
    std::sort(names.begin(), names.end());
    throw InputError("xacro.unknown_macro", placed(in.where, context),
                     fmt::format("unknown macro '{}'{}", name, did_you_mean(name, names)),
                     "macros have to be defined or included before they are called");
  }
  Context inside = deeper(in, caller, fmt::format("in macro '{}'", macro->name));
  auto inner = std::make_unique<Scope>(interpreter_, caller.scope, Scope::Kind::macro);
  Call binding{in, *macro, caller, *inner, through_call, {}};
  for (const Macro::Parameter& p : macro->parameters) binding.open.push_back(p.name);
  bind_attributes(binding);
  bind_blocks(binding);
  bind_defaults(binding);
  MacroTable macros(caller.macros);
  inside.scope = inner.get();
  inside.macros = &macros;
  std::vector<XmlAttribute> lifted = macro->element->attributes;
  Output made = make_output(&lifted);
  children(*macro->element, inside, made);
  drop_comments(child, out);
  lift_namespaces(lifted, out, context);
  std::move(made.nodes.begin(), made.nodes.end(), std::back_inserter(out.nodes));
  if (inner->retained()) interpreter_.keep(std::move(inner));
}

void Expander::dynamic_call(const Child& child, const Context& context, Output& out) {
  const XmlAttribute& name = required(child.node, "macro", context);
  call(child, value_of(name, context).str(), true, context, out);
}

}  // namespace doppel::xacro
