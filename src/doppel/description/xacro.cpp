#include "doppel/description/xacro.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/core/names.h"
#include "doppel/description/xacro_expander.h"

namespace doppel {
namespace xacro {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "xacro:";

bool blank(const std::string& text) {
  return !text.empty() && text.find_first_not_of(" \t\r\n\v\f") == std::string::npos;
}

// A run-away recursion is told by its first call, not by a hundred of them.
SourceLocation outermost(SourceLocation where) {
  while (where.within) where = SourceLocation(where.within->call);
  return where;
}

bool python_keyword(const std::string& name) {
  static const std::set<std::string> kWords{
      "False", "None",     "True",  "and",    "as",   "assert", "async",  "await",    "break",
      "class", "continue", "def",   "del",    "elif", "else",   "except", "finally",  "for",
      "from",  "global",   "if",    "import", "in",   "is",     "lambda", "nonlocal", "not",
      "or",    "pass",     "raise", "return", "try",  "while",  "with",   "yield"};
  return kWords.contains(name);
}

bool identifier(const std::string& name) {
  if (name.empty() || (name[0] >= '0' && name[0] <= '9') || python_keyword(name)) return false;
  return std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           static_cast<unsigned char>(c) >= 0x80;
  });
}

void set_attribute(std::vector<XmlAttribute>& list, XmlAttribute made) {
  const auto known =
      std::find_if(list.begin(), list.end(), [&made](const XmlAttribute& a) { return a.name == made.name; });
  if (known != list.end())
    *known = std::move(made);
  else
    list.push_back(std::move(made));
}

}  // namespace

XacroResult Expander::run(XmlNode root, const fs::path& file,
                          const std::vector<std::pair<std::string, std::string>>& arguments) {
  const StackGuard guard;
  for (const auto& [name, value] : arguments) {
    if (!value.empty()) interpreter_.set_argument(name, value);
  }
  interpreter_.add_file(file);
  const Interpreter::Reading reading(interpreter_, file);
  documents_.push_back({{}, {}, std::move(root)});
  const XmlNode& in = documents_.back().root;
  Context context;
  context.scope = &document_;
  context.macros = &macros_;
  XacroResult out;
  out.root.name = in.name;
  out.root.where = in.where;
  attributes(in, context, out.root.attributes);
  if (const XmlAttribute* space = in.find("xacro:targetNamespace"))
    set_attribute(out.root.attributes, {"xmlns", space->value, space->where});
  Output inner = make_output(&out.root.attributes);
  children(in, context, inner);
  out.root.children = std::move(inner.nodes);
  out.files = interpreter_.files();
  out.declared_arguments = declared_;
  out.used_arguments.assign(interpreter_.used_arguments().begin(), interpreter_.used_arguments().end());
  return out;
}

const XmlAttribute& Expander::required(const XmlNode& node, const char* name, const Context& context) const {
  if (const XmlAttribute* a = node.find(name)) return *a;
  std::vector<std::string> names;
  for (const XmlAttribute& a : node.attributes) names.push_back(a.name);
  const auto near = nearest_name(name, names);
  throw InputError("xacro.missing_attribute", placed(node.where, context),
                   fmt::format("<{}> has no attribute '{}'{}", node.name, name,
                               near ? fmt::format("; is '{}' meant?", *near) : ""));
}

bool Expander::condition_of(const XmlAttribute* a, bool fallback, const Context& context) {
  if (a == nullptr) return fallback;
  return interpreter_.condition(a->value, *context.scope, placed(a->where, context));
}

void Expander::check_attributes(const XmlNode& node, std::initializer_list<std::string_view> known,
                                const Context& context) {
  for (const XmlAttribute& a : node.attributes) {
    if (std::find(known.begin(), known.end(), a.name) != known.end() || a.name.starts_with("xmlns:"))
      continue;
    const std::vector<std::string> names(known.begin(), known.end());
    diagnostics_.warning(
        "xacro.unknown_attribute", placed(a.where, context),
        fmt::format("<{}> knows no attribute '{}'{}", node.name, a.name, did_you_mean(a.name, names)));
  }
}

void Expander::count_node(const XmlNode& node, const Context& context) {
  if (--interpreter_.budget().nodes >= 0) return;
  throw InputError("xacro.too_much", outermost(placed(node.where, context)),
                   "the expansion grows without end",
                   "look for a macro that calls itself or doubles its output");
}

Context Expander::deeper(const XmlNode& node, const Context& context, std::string what) const {
  const SourceLocation where = placed(node.where, context);
  const int deepest = Budget().deepest;
  if (context.depth >= deepest || StackGuard::exhausted()) {
    throw InputError("xacro.too_deep", outermost(where),
                     fmt::format("macros and includes are nested more than {} deep, {}", deepest, what),
                     "look for one that calls or includes itself without an end");
  }
  Context out = context;
  out.within = std::make_shared<SourceLocation::Within>(SourceLocation::Within{where, std::move(what)});
  out.depth = context.depth + 1;
  return out;
}

const std::unordered_map<std::string, Expander::Handler>& Expander::handlers() {
  static const std::unordered_map<std::string, Handler> table{
      {"property", &Expander::property},       {"macro", &Expander::macro},
      {"include", &Expander::include},         {"arg", &Expander::argument},
      {"if", &Expander::conditional},          {"unless", &Expander::conditional},
      {"insert_block", &Expander::insert},     {"call", &Expander::dynamic_call},
      {"element", &Expander::dynamic_element}, {"attribute", &Expander::added_attribute}};
  return table;
}

void Expander::children(const XmlNode& parent, const Context& context, Output& out) {
  bool eval_comments = false;
  out.nodes.reserve(out.nodes.size() + parent.children.size());
  for (std::size_t i = 0; i < parent.children.size(); ++i) {
    const XmlNode& node = parent.children[i];
    count_node(node, context);
    switch (node.kind) {
      case XmlNode::Kind::element:
        eval_comments = false;
        element_child({node, i + 1 == parent.children.size()}, node.name, context, out);
        settle_barrier(out);
        break;
      case XmlNode::Kind::text:
        text(node, context, out, eval_comments);
        break;
      case XmlNode::Kind::comment:
        comment(node, context, out, eval_comments);
        break;
      case XmlNode::Kind::instruction:
        out.nodes.push_back(node);
        break;
    }
  }
}

void Expander::text(const XmlNode& in, const Context& context, Output& out, bool& eval_comments) {
  XmlNode& made = out.nodes.emplace_back();
  made.kind = in.kind;
  made.cdata = in.cdata;
  if (in.where.known()) made.where = placed(in.where, context);  // blank text has no place
  if (in.cdata || in.text.find('$') == std::string::npos)
    made.text = in.text;
  else
    made.text = interpreter_.string(in.text, *context.scope, made.where);
  if (eval_comments && !made.text.empty() && !blank(made.text)) eval_comments = false;
}

void Expander::comment(const XmlNode& in, const Context& context, Output& out, bool& eval_comments) {
  if (in.text.find("xacro:eval-comments") != std::string::npos) {
    eval_comments = in.text.find("xacro:eval-comments:off") == std::string::npos;
    return;
  }
  XmlNode& made = out.nodes.emplace_back(in);
  if (eval_comments) made.text = interpreter_.string(in.text, *context.scope, placed(in.where, context));
}

void Expander::element_child(const Child& child, const std::string& name, const Context& context,
                             Output& out) {
  if (!name.starts_with(kPrefix)) return element(child.node, name, context, out);
  const std::string command = name.substr(kPrefix.size());
  if (const auto handler = handlers().find(command); handler != handlers().end())
    return (this->*handler->second)(child, context, out);
  call(child, command, false, context, out);
}

void Expander::attributes(const XmlNode& in, const Context& context, std::vector<XmlAttribute>& out) {
  out.reserve(in.attributes.size());
  for (const XmlAttribute& a : in.attributes) {
    if (a.name.starts_with(kPrefix) || a.name == "xmlns:xacro") continue;
    SourceLocation where = placed(a.where, context);
    std::string value = interpreter_.string(a.value, *context.scope, where);
    out.push_back({a.name, std::move(value), std::move(where)});
  }
}

void Expander::element(const XmlNode& in, const std::string& name, const Context& context, Output& out) {
  if (StackGuard::exhausted())
    throw InputError("xacro.too_deep", outermost(placed(in.where, context)),
                     "elements are nested too deeply");
  XmlNode made;
  made.name = name;
  made.where = placed(in.where, context);
  attributes(in, context, made.attributes);
  if (!in.children.empty()) {
    Output inner = make_output(&made.attributes);
    children(in, context, inner);
    made.children = std::move(inner.nodes);
  }
  out.nodes.push_back(std::move(made));
}

// An invisible blank text stands behind the last of xacro's elements that looked for comments; comments
// before it stay.
bool Expander::barrier_at(const Output& out, std::size_t position) const {
  return barrier_.settled && barrier_.output == out.id && barrier_.position == position;
}
void Expander::settle_barrier(const Output& out) {
  if (barrier_.settled || barrier_.output != out.id) return;
  barrier_.position = out.nodes.size();
  barrier_.settled = true;
}

void Expander::drop_comments(const Child& child, Output& out) {
  if (keep_ == XmlKeep::content) return;
  std::size_t at = out.nodes.size();
  while (at > 0 || barrier_at(out, at)) {
    if (!barrier_at(out, at)) {
      const XmlNode& previous = out.nodes[at - 1];
      const bool skips = previous.kind == XmlNode::Kind::text && !previous.cdata && blank(previous.text) &&
                         std::count(previous.text.begin(), previous.text.end(), '\n') <= 1;
      if (skips) --at;
    }
    const bool comment = at > 0 && !barrier_at(out, at) && out.nodes[at - 1].kind == XmlNode::Kind::comment;
    if (!comment) {
      if (!child.last) barrier_ = {out.id, 0, false};
      return;
    }
    out.nodes.erase(out.nodes.begin() + static_cast<std::ptrdiff_t>(--at));
  }
}

std::string Expander::property_name(const XmlNode& in, const Context& context) {
  const XmlAttribute& attribute = required(in, "name", context);
  std::string name = value_of(attribute, context).str();
  if (!identifier(name)) {
    throw InputError("xacro.property_name", placed(attribute.where, context),
                     fmt::format("'{}' cannot be the name of a property", name),
                     "letters, digits and underscores, no keyword of Python: expressions have to read it");
  }
  if (name.starts_with("__"))
    throw InputError("xacro.property_name", placed(attribute.where, context),
                     fmt::format("the name '{}' of a property begins with two underscores", name));
  return name;
}

// Where a property goes; null: nowhere.
Scope* Expander::property_scope(const XmlNode& in, const std::string& name, const Context& context) {
  Scope* target = context.scope;
  const XmlAttribute* wanted = in.find("scope");
  if (wanted == nullptr || (wanted->value != "global" && wanted->value != "parent")) return target;
  if (wanted->value == "global") return &target->root();
  target = target->parent();
  if (context.scope->kind() != Scope::Kind::space) {
    while (target != nullptr && target->kind() == Scope::Kind::space) target = target->parent();
  }
  if (target == nullptr)
    diagnostics_.warning("xacro.scope", placed(wanted->where, context),
                         fmt::format("the property '{}' has no scope around it; it is not defined", name));
  return target;
}

void Expander::property(const Child& child, const Context& context, Output& out) {
  drop_comments(child, out);
  const XmlNode& in = child.node;
  check_attributes(in, {"name", "value", "default", "remove", "scope", "lazy_eval"}, context);
  const std::string name = property_name(in, context);
  const XmlAttribute *value = in.find("value"), *fallback = in.find("default");
  const bool remove = condition_of(in.find("remove"), false, context);
  if ((value != nullptr) + (fallback != nullptr) + remove > 1)
    throw InputError("xacro.property", placed(in.where, context),
                     fmt::format("value, default and remove exclude each other, in the property '{}'", name));
  if (remove) return context.scope->remove(name);
  if (fallback != nullptr) {
    if (context.scope->knows(name)) return;
    value = fallback;
  }
  Scope* target = property_scope(in, name, context);
  if (target == nullptr) return;
  if (value == nullptr) {
    // The node lies in a document, which outlives all blocks.
    target->set_block("**" + name, {{std::shared_ptr<const XmlNode>(), &in}, context.within});
    return;
  }
  const bool lazy = condition_of(in.find("lazy_eval"), true, context);
  const SourceLocation where = placed(value->where, context);
  if (lazy && target == context.scope && in.find("scope") == nullptr)
    target->set_text(name, value->value, where);
  else
    target->set(name, interpreter_.text(value->value, *context.scope, where));
}

void Expander::macro(const Child& child, const Context& context, Output& out) {
  drop_comments(child, out);
  const XmlNode& in = child.node;
  check_attributes(in, {"name", "params"}, context);
  auto made = std::make_shared<Macro>();
  const XmlAttribute& name = required(in, "name", context);
  made->name = value_of(name, context).str();
  made->where = placed(in.where, context);
  if (made->name.starts_with(kPrefix)) {
    diagnostics_.warning(
        "xacro.macro_name", placed(name.where, context),
        fmt::format("the macro name '{}' holds the prefix 'xacro:', which is left off", made->name));
    made->name.erase(0, kPrefix.size());
  }
  if (made->name.find('.') != std::string::npos || made->name == "call")
    throw InputError("xacro.macro_name", placed(name.where, context),
                     fmt::format("a macro cannot be called '{}'", made->name),
                     "'call' is an element of xacro, and a '.' stands between a namespace and a macro");
  if (const XmlAttribute* parameters = in.find("params"))
    made->parameters = parse_parameters(parameters->value, placed(parameters->where, context));
  made->element = &in;
  context.macros->add(std::move(made));
}

void Expander::argument(const Child& child, const Context& context, Output& out) {
  const XmlNode& in = child.node;
  check_attributes(in, {"name", "default"}, context);
  const std::string name = value_of(required(in, "name", context), context).str();
  declared_.push_back(name);
  const XmlAttribute* fallback = in.find("default");
  if (fallback != nullptr && !interpreter_.has_argument(name))
    interpreter_.set_argument(name, value_of(*fallback, context).str());
  drop_comments(child, out);
}

void Expander::conditional(const Child& child, const Context& context, Output& out) {
  drop_comments(child, out);
  const XmlNode& in = child.node;
  check_attributes(in, {"value"}, context);
  const bool wanted = condition_of(&required(in, "value", context), false, context);
  if (wanted != (in.name == "xacro:if")) return;
  std::vector<XmlAttribute> nowhere;
  Output inner = make_output(&nowhere);
  children(in, context, inner);
  std::move(inner.nodes.begin(), inner.nodes.end(), std::back_inserter(out.nodes));
}

void Expander::insert(const Child& child, const Context& context, Output& out) {
  const XmlNode& in = child.node;
  check_attributes(in, {"name"}, context);
  const std::string name = value_of(required(in, "name", context), context).str();
  const Block* found = context.scope->find_block("**" + name);
  const bool whole = found == nullptr;
  if (whole) found = context.scope->find_block("*" + name);
  if (found == nullptr) {
    throw InputError(
        "xacro.undefined_block", placed(in.where, context), fmt::format("undefined block '{}'", name),
        "it has to be a block parameter (*name) of the macro, or a property with elements inside");
  }
  const Block block = *found;
  Context inside = deeper(in, context, fmt::format("in block '{}'", name));
  inside.within = block.within;
  std::vector<XmlAttribute> nowhere;
  Output inner = make_output(&nowhere);
  if (whole)
    element(*block.node, block.node->name, inside, inner);
  else
    children(*block.node, inside, inner);
  std::move(inner.nodes.begin(), inner.nodes.end(), std::back_inserter(out.nodes));
}

void Expander::dynamic_element(const Child& child, const Context& context, Output& out) {
  const XmlAttribute* given = child.node.find("xacro:name");
  const XmlAttribute& from = given != nullptr ? *given : required(child.node, "xacro:name", context);
  const std::string name = value_of(from, context).str();
  if (name.empty() || name == child.node.name)
    throw InputError("xacro.element", placed(from.where, context),
                     fmt::format("<xacro:element> cannot make an element called '{}'", name));
  element_child(child, name, context, out);
}

void Expander::added_attribute(const Child& child, const Context& context, Output& out) {
  const XmlAttribute& from = required(child.node, "name", context);
  const XmlAttribute& value = required(child.node, "value", context);
  const std::string name = value_of(from, context).str();
  if (name.empty())
    throw InputError("xacro.attribute", placed(from.where, context), "<xacro:attribute> has an empty name");
  set_attribute(*out.parent, {name, value_of(value, context).str(), placed(value.where, context)});
}

}  // namespace xacro

bool needs_xacro(const XmlNode& root) {
  for (const XmlAttribute& a : root.attributes) {
    if (a.name.starts_with("xmlns:") && a.value.find("xacro") != std::string::npos) return true;
  }
  return std::any_of(root.children.begin(), root.children.end(), [](const XmlNode& child) {
    return child.kind == XmlNode::Kind::element && (child.name.starts_with("xacro:") || needs_xacro(child));
  });
}

XacroResult expand_xacro(XmlNode root, const std::filesystem::path& file,
                         const std::vector<std::pair<std::string, std::string>>& arguments,
                         const PackageResolver& resolver, Diagnostics& diagnostics, XmlKeep keep) {
  return xacro::Expander(resolver, diagnostics, keep).run(std::move(root), file, arguments);
}

XacroResult expand_xacro(const std::filesystem::path& file,
                         const std::vector<std::pair<std::string, std::string>>& arguments,
                         const PackageResolver& resolver, Diagnostics& diagnostics) {
  return expand_xacro(load_xml(file.string()), file, arguments, resolver, diagnostics);
}

}  // namespace doppel
