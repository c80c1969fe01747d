#include "doppel/description/xacro/xacro.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/base/core/names.h"
#include "doppel/description/xacro/detail/characters.h"
#include "doppel/description/xacro/detail/xacro_expander.h"

namespace doppel {
namespace xacro {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "xacro:";

// An infinite recursion is reported at its first call, not with a hundred of them.
SourceLocation outermost(SourceLocation where) {
  while (where.within) where = SourceLocation(where.within->call);
  return where;
}

bool python_keyword(std::string_view name) {
  static constexpr std::array<std::string_view, 35> kWords{
      "False", "None",     "True",  "and",    "as",   "assert", "async",  "await",    "break",
      "class", "continue", "def",   "del",    "elif", "else",   "except", "finally",  "for",
      "from",  "global",   "if",    "import", "in",   "is",     "lambda", "nonlocal", "not",
      "or",    "pass",     "raise", "return", "try",  "while",  "with",   "yield"};
  return name.size() <= 8 && std::binary_search(kWords.begin(), kWords.end(), name);
}

bool identifier(std::string_view name) {
  if (name.empty() || (name[0] >= '0' && name[0] <= '9') || python_keyword(name)) return false;
  return std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           static_cast<unsigned char>(c) >= 0x80;
  });
}

bool substitution(std::string_view text) {
  return text.find("${") != std::string_view::npos || text.find("$(") != std::string_view::npos;
}

// True if any text or attribute in it has to be evaluated.
bool has_substitution(const TreeNode& node) {
  if (node.constant || node.kind == TreeNode::Kind::comment || node.kind == TreeNode::Kind::instruction)
    return false;
  if (node.kind == TreeNode::Kind::text) return !node.cdata && node.dollar && substitution(node.text);
  for (const TreeAttribute* a = node.attributes; a != nullptr; a = a->next) {
    if (a->dollar && substitution(a->value)) return true;
  }
  for (const TreeNode* child = node.first; child != nullptr; child = child->next) {
    if (has_substitution(*child)) return true;
  }
  return false;
}

bool has_xacro(const TreeNode& node) {
  for (const TreeNode* child = node.first; child != nullptr; child = child->next) {
    if (child->constant || child->kind != TreeNode::Kind::element) continue;
    if (child->name.starts_with(kPrefix) || has_xacro(*child)) return true;
  }
  return false;
}

}  // namespace

const TreeAttribute* Attributes::find(std::string_view name) const {
  for (const TreeAttribute* a = first_; a != nullptr; a = a->next) {
    if (a->name == name) return a;
  }
  return nullptr;
}

void Attributes::set(const TreeAttribute& made, Arena& arena) {
  if (shared_) {
    TreeAttribute* from = std::exchange(first_, nullptr);
    TreeAttribute** end = &first_;
    for (; from != nullptr; from = from->next, end = &(*end)->next) {
      *end = arena.make<TreeAttribute>(*from);
      (*end)->next = nullptr;
    }
    shared_ = false;
  }
  TreeAttribute** at = &first_;
  while (*at != nullptr && (*at)->name != made.name) at = &(*at)->next;
  TreeAttribute* const next = *at == nullptr ? nullptr : (*at)->next;
  *at = arena.make<TreeAttribute>(made);
  (*at)->next = next;
}

XacroResult Expander::run(XmlTree source, const fs::path& file,
                          const std::vector<std::pair<std::string, std::string>>& arguments) {
  const StackGuard guard;
  keep_ = source.keep;
  audit_document(source, kTopLevel);
  sources_ = std::move(source.sources);
  sources_.push_back(interpreter_.source());
  for (const auto& [name, value] : arguments) {
    if (!value.empty()) interpreter_.set_argument(name, value);
  }
  interpreter_.add_file(file);
  const Interpreter::Reading reading(interpreter_, file);
  const TreeNode& in = *source.root;
  interpreter_.add_document(in);
  Context context;
  context.scope = &document_;
  context.macros = &macros_;
  TreeNode* const root = copy_of(in, context);
  Attributes attributes = this->attributes(in, context);
  if (const TreeAttribute* space = in.find("xacro:targetNamespace")) {
    TreeAttribute made = *space;
    made.name = "xmlns";
    attributes.set(made, arena_);
  }
  Output inner = make_output(&attributes);
  children(in, context, inner);
  root->attributes = attributes.first();
  root->first = inner.nodes.first;
  root->last = inner.nodes.last;
  XacroResult out;
  out.tree.before = source.before;
  out.tree.after = source.after;
  out.tree.root = root;
  out.tree.keep = keep_;
  out.tree.sources = std::move(sources_);
  out.files = std::move(interpreter_.files());
  out.declared_arguments = std::move(declared_);
  out.used_arguments.assign(interpreter_.used_arguments().begin(), interpreter_.used_arguments().end());
  return out;
}

// A file has to declare the prefixes that it uses, except for xacro's own; ros/xacro rejects it otherwise.
void Expander::audit_document(const XmlTree& tree, const TreeWithin& within) {
  for (Diagnostic warning : tree.tolerated) {
    warning.where.within = steps_of(&within);
    diagnostics_.add(std::move(warning));
  }
  if (tree.undeclared.empty()) return;
  SourceLocation where = locate(tree.undeclared_at);
  where.within = steps_of(&within);
  if (tree.undeclared == "xacro") {
    diagnostics_.warning("xml.prefix", where,
                         "the prefix 'xacro' is not declared; ros/xacro rejects the file",
                         "write xmlns:xacro=\"http://www.ros.org/wiki/xacro\" into the root element");
    return;
  }
  throw InputError(
      "xml.prefix", where,
      fmt::format("the prefix '{}' is not declared, so xacro rejects the file", tree.undeclared),
      fmt::format("write xmlns:{}=\"...\" into the root element, or remove the prefix", tree.undeclared));
}

const TreeAttribute& Expander::required(const TreeNode& node, std::string_view name, const Context& context) {
  if (const TreeAttribute* a = node.find(name)) return *a;
  std::vector<std::string> names;
  for (const TreeAttribute* a = node.attributes; a != nullptr; a = a->next) names.emplace_back(a->name);
  const auto near = nearest_name(name, names);
  throw InputError("xacro.missing_attribute", location_of(node.where, context),
                   fmt::format("<{}> has no attribute '{}'{}", node.name, name,
                               near ? fmt::format("; did you mean '{}'?", *near) : ""));
}

bool Expander::condition_of(const TreeAttribute* a, bool fallback, const Context& context) {
  if (a == nullptr) return fallback;
  return interpreter_.condition(a->value, *context.scope, placed(a->where, context));
}

void Expander::check_attributes(const TreeNode& node, std::initializer_list<std::string_view> known,
                                const Context& context) {
  for (const TreeAttribute* a = node.attributes; a != nullptr; a = a->next) {
    if (std::find(known.begin(), known.end(), a->name) != known.end() || a->name.starts_with("xmlns:"))
      continue;
    const std::vector<std::string> names(known.begin(), known.end());
    diagnostics_.warning(
        "xacro.unknown_attribute", location_of(a->where, context),
        fmt::format("<{}> has no attribute '{}'{}", node.name, a->name, did_you_mean(a->name, names)));
  }
}

void Expander::count_nodes(std::int64_t nodes, const TreeNode& node, const Context& context) {
  if ((interpreter_.budget().nodes -= nodes) >= 0) return;
  throw InputError("xacro.too_much", outermost(location_of(node.where, context)),
                   "the expansion grows without bound",
                   "look for a macro that calls itself or doubles its output");
}

Context Expander::deeper(const TreeNode& node, const Context& context, std::string_view what,
                         std::string_view name) const {
  const int deepest = Budget().deepest;
  if (context.depth >= deepest || StackGuard::exhausted()) {
    if (const std::string loop = interpreter_.include_loop(); !loop.empty()) {
      TreePlace here = node.where;  // without the chain of includes
      here.within = nullptr;
      throw InputError("xacro.include_loop", locate(here),
                       fmt::format("files include each other recursively: {}", loop),
                       "remove this <xacro:include>, or move the common part to a third file");
    }
    throw InputError("xacro.too_deep", outermost(location_of(node.where, context)),
                     fmt::format("macros and includes are nested more than {} deep, {}{}", deepest, what,
                                 name.empty() ? "" : fmt::format(" '{}'", name)),
                     "look for one that calls or includes itself");
  }
  Context out = context;
  out.within = arena_.make<TreeWithin>(placed(node.where, context), what, name);
  out.depth = context.depth + 1;
  return out;
}

// A copy of the node alone, without its siblings; it shares the children and attributes of the original.
TreeNode* Expander::copy_of(const TreeNode& in, const Context& context) {
  auto* const out = arena_.make<TreeNode>(in);
  out->next = out->previous = nullptr;
  if (in.where.known()) out->where = placed(in.where, context);
  return out;
}

std::span<const Expander::Command> Expander::commands() {
  static constexpr std::array<Command, 10> kTable{{{"property", &Expander::property},
                                                   {"if", &Expander::conditional},
                                                   {"unless", &Expander::conditional},
                                                   {"macro", &Expander::macro},
                                                   {"insert_block", &Expander::insert},
                                                   {"include", &Expander::include},
                                                   {"arg", &Expander::argument},
                                                   {"call", &Expander::dynamic_call},
                                                   {"element", &Expander::dynamic_element},
                                                   {"attribute", &Expander::added_attribute}}};
  return kTable;
}

void Expander::children(const TreeNode& parent, const Context& context, Output& out) {
  bool eval_comments = false;
  for (const TreeNode* node = parent.first; node != nullptr; node = node->next) {
    count_nodes(1, *node, context);
    switch (node->kind) {
      case TreeNode::Kind::element:
        eval_comments = false;
        element_child(*node, node->name, context, out);
        settle_barrier(out);
        break;
      case TreeNode::Kind::text:
        text(*node, context, out, eval_comments);
        break;
      case TreeNode::Kind::comment:
        comment(*node, context, out, eval_comments);
        break;
      case TreeNode::Kind::instruction:
        out.nodes.push_back(copy_of(*node, context));
        break;
    }
  }
}

void Expander::text(const TreeNode& in, const Context& context, Output& out, bool& eval_comments) {
  TreeNode* const made = copy_of(in, context);
  if (in.dollar && !in.cdata) {
    made->text = interpreter_.string(in.text, *context.scope, made->where);
    made->dollar = made->text.find('$') != std::string_view::npos;
    made->blank = !made->text.empty() && is_blank(made->text);
  }
  if (eval_comments && !made->text.empty() && !made->blank) eval_comments = false;
  out.nodes.push_back(made);
}

void Expander::comment(const TreeNode& in, const Context& context, Output& out, bool& eval_comments) {
  if (in.text.find("xacro:eval-comments") != std::string_view::npos) {
    eval_comments = in.text.find("xacro:eval-comments:off") == std::string_view::npos;
    return;
  }
  TreeNode* const made = copy_of(in, context);
  if (eval_comments && in.dollar) made->text = interpreter_.string(in.text, *context.scope, made->where);
  out.nodes.push_back(made);
}

void Expander::element_child(const TreeNode& in, std::string_view name, const Context& context, Output& out) {
  if (!name.starts_with(kPrefix)) return element(in, name, context, out);
  const std::string_view wanted = name.substr(kPrefix.size());
  for (const auto& [command, handler] : commands()) {
    if (command == wanted) return (this->*handler)(in, context, out);
  }
  call(in, wanted, false, context, out);
}

Attributes Expander::attributes(const TreeNode& in, const Context& context) {
  const auto own = [](const TreeAttribute& a) {
    return a.name[0] == 'x' && (a.name.starts_with(kPrefix) || a.name == "xmlns:xacro");
  };
  const TreeAttribute* a = in.attributes;
  while (a != nullptr && !a->dollar && !own(*a)) a = a->next;
  if (a == nullptr) return {in.attributes, true};
  TreeAttribute* first = nullptr;
  TreeAttribute** end = &first;
  for (a = in.attributes; a != nullptr; a = a->next) {
    if (own(*a)) continue;
    auto* const made = arena_.make<TreeAttribute>(*a);
    made->next = nullptr;
    if (a->dollar) {
      made->value = text_of(*a, context);
      made->dollar = made->value.find('$') != std::string_view::npos;
    }
    *end = made;
    end = &made->next;
  }
  return {first, false};
}

void Expander::element(const TreeNode& in, std::string_view name, const Context& context, Output& out) {
  if (StackGuard::exhausted())
    throw InputError("xacro.too_deep", outermost(location_of(in.where, context)),
                     "elements are nested too deeply");
  TreeNode* const made = copy_of(in, context);
  made->name = name;
  if (in.constant) {
    count_nodes(in.weight - 1, in, context);
    out.nodes.push_back(made);
    return;
  }
  Attributes attributes = this->attributes(in, context);
  if (in.first != nullptr) {
    Output inner = make_output(&attributes);
    children(in, context, inner);
    made->first = inner.nodes.first;
    made->last = inner.nodes.last;
  }
  made->attributes = attributes.first();
  out.nodes.push_back(made);
}

// Marks the position behind the last element of xacro that dropped comments; comments before it stay.
bool Expander::barrier_behind(const Output& out, const TreeNode* node) const {
  return barrier_.settled && barrier_.output == out.id && barrier_.behind == node;
}
void Expander::settle_barrier(const Output& out) {
  if (barrier_.settled || barrier_.output != out.id) return;
  barrier_.behind = out.nodes.last;
  barrier_.settled = true;
}

void Expander::drop_comments(const TreeNode& in, Output& out) {
  if (keep_ == XmlContent::content) return;
  TreeNode* at = out.nodes.last;
  while (at != nullptr || barrier_behind(out, at)) {
    if (!barrier_behind(out, at)) {
      const bool skips = at->kind == TreeNode::Kind::text && !at->cdata && at->blank &&
                         std::count(at->text.begin(), at->text.end(), '\n') <= 1;
      if (skips) at = at->previous;
    }
    if (at == nullptr || barrier_behind(out, at) || at->kind != TreeNode::Kind::comment) {
      if (in.next != nullptr) barrier_ = {out.id, nullptr, false};
      return;
    }
    TreeNode* const before = at->previous;
    out.nodes.erase(at);
    at = before;
  }
}

std::string_view Expander::property_name(const TreeNode& in, const Context& context) {
  const TreeAttribute& attribute = required(in, "name", context);
  const std::string_view name = text_of(attribute, context);
  if (!identifier(name)) {
    throw InputError(
        "xacro.property_name", location_of(attribute.where, context),
        fmt::format("'{}' cannot be the name of a property", name),
        "use letters, digits and underscores, and no Python keyword: expressions must be able to read it");
  }
  if (name.starts_with("__"))
    throw InputError("xacro.property_name", location_of(attribute.where, context),
                     fmt::format("the name '{}' of a property begins with two underscores", name));
  return name;
}

// The scope that a property is defined in; null: none.
Scope* Expander::property_scope(const TreeNode& in, std::string_view name, const Context& context) {
  Scope* target = context.scope;
  const TreeAttribute* wanted = in.find("scope");
  if (wanted == nullptr || (wanted->value != "global" && wanted->value != "parent")) return target;
  if (wanted->value == "global") return &target->root();
  target = target->parent();
  if (context.scope->kind() != Scope::Kind::space) {
    while (target != nullptr && target->kind() == Scope::Kind::space) target = target->parent();
  }
  if (target == nullptr)
    diagnostics_.warning("xacro.scope", location_of(wanted->where, context),
                         fmt::format("the property '{}' has no enclosing scope; it is not defined", name));
  return target;
}

void Expander::property(const TreeNode& in, const Context& context, Output& out) {
  drop_comments(in, out);
  check_attributes(in, {"name", "value", "default", "remove", "scope", "lazy_eval"}, context);
  const std::string_view name = property_name(in, context);
  const TreeAttribute *value = in.find("value"), *fallback = in.find("default");
  const bool remove = condition_of(in.find("remove"), false, context);
  if ((value != nullptr) + (fallback != nullptr) + remove > 1)
    throw InputError(
        "xacro.property", location_of(in.where, context),
        fmt::format("value, default and remove are mutually exclusive in the property '{}'", name));
  if (remove) return context.scope->remove(name);
  if (fallback != nullptr) {
    if (context.scope->knows(name)) return;
    value = fallback;
  }
  Scope* target = property_scope(in, name, context);
  if (target == nullptr) return;
  if (value == nullptr) {
    target->set_block(arena_.copy(fmt::format("**{}", name)), {&in, context.within});
    return;
  }
  const bool lazy = condition_of(in.find("lazy_eval"), true, context);
  const TreePlace where = placed(value->where, context);
  const TreeAttribute* const scope = in.find("scope");
  const bool elsewhere = scope != nullptr && (scope->value == "global" || scope->value == "parent");
  if (lazy && !elsewhere)
    target->set_text(name, value->value, where);
  else
    target->set(name, interpreter_.text(value->value, *context.scope, where));
}

void Expander::macro(const TreeNode& in, const Context& context, Output& out) {
  drop_comments(in, out);
  check_attributes(in, {"name", "params"}, context);
  auto made = std::make_shared<Macro>();
  const TreeAttribute& name = required(in, "name", context);
  made->name = name.value;  // as it is written, also with an expression
  made->where = placed(in.where, context);
  if (made->name.starts_with(kPrefix)) {
    diagnostics_.warning(
        "xacro.macro_name", location_of(name.where, context),
        fmt::format("the macro name '{}' has the prefix 'xacro:', which is dropped", made->name));
    made->name.remove_prefix(kPrefix.size());
  }
  if (made->name.find('.') != std::string_view::npos || made->name == "call")
    throw InputError("xacro.macro_name", location_of(name.where, context),
                     fmt::format("a macro cannot be named '{}'", made->name),
                     "'call' is an element of xacro, and a '.' stands between a namespace and a macro");
  if (const TreeAttribute* parameters = in.find("params"))
    made->parameters = parse_parameters(parameters->value, placed(parameters->where, context));
  made->element = &in;
  context.macros->add(std::move(made));
}

void Expander::argument(const TreeNode& in, const Context& context, Output& out) {
  check_attributes(in, {"name", "default"}, context);
  const std::string_view name = text_of(required(in, "name", context), context);
  declared_.emplace_back(name);
  const TreeAttribute* fallback = in.find("default");
  if (fallback != nullptr && !interpreter_.has_argument(name))
    interpreter_.set_argument(name, text_of(*fallback, context));
  drop_comments(in, out);
}

void Expander::conditional(const TreeNode& in, const Context& context, Output& out) {
  drop_comments(in, out);
  check_attributes(in, {"value"}, context);
  const bool wanted = condition_of(&required(in, "value", context), false, context);
  if (wanted != (in.name == "xacro:if")) return;
  Attributes nowhere;
  Output inner = make_output(&nowhere);
  children(in, context, inner);
  out.nodes.append(inner.nodes);
}

void Expander::insert(const TreeNode& in, const Context& context, Output& out) {
  check_attributes(in, {"name"}, context);
  const std::string_view name = text_of(required(in, "name", context), context);
  const Block* found = context.scope->find_block("**", name);
  const bool whole = found == nullptr;
  if (whole) found = context.scope->find_block("*", name);
  if (found == nullptr) {
    throw InputError("xacro.undefined_block", location_of(in.where, context),
                     fmt::format("undefined block '{}'", name),
                     "it must be a block parameter (*name) of the macro, or a property with child elements");
  }
  const Block block = *found;
  Context inside = deeper(in, context, "in block", name);
  inside.within = block.within;
  Attributes nowhere;
  Output inner = make_output(&nowhere);
  if (whole)
    element(*block.node, block.node->name, inside, inner);
  else
    children(*block.node, inside, inner);
  out.nodes.append(inner.nodes);
}

void Expander::dynamic_element(const TreeNode& in, const Context& context, Output& out) {
  const TreeAttribute& from = required(in, "xacro:name", context);
  const std::string_view name = text_of(from, context);
  if (name.empty() || name == in.name)
    throw InputError("xacro.element", location_of(from.where, context),
                     fmt::format("<xacro:element> cannot create an element named '{}'", name));
  element_child(in, name, context, out);
}

void Expander::added_attribute(const TreeNode& in, const Context& context, Output& out) {
  const TreeAttribute& from = required(in, "name", context);
  const TreeAttribute& value = required(in, "value", context);
  const std::string_view name = text_of(from, context);
  if (name.empty())
    throw InputError("xacro.attribute", location_of(from.where, context),
                     "<xacro:attribute> has an empty name");
  TreeAttribute made;
  made.name = name;
  made.value = text_of(value, context);
  made.dollar = made.value.find('$') != std::string_view::npos;
  made.where = placed(value.where, context);
  out.parent->set(made, arena_);
}

}  // namespace xacro

bool needs_xacro(const XmlTree& tree) {
  if (tree.root->name.starts_with("xacro:") || xacro::has_substitution(*tree.root)) return true;
  for (const TreeAttribute* a = tree.root->attributes; a != nullptr; a = a->next) {
    if (a->name.starts_with("xmlns:") && a->value.find("xacro") != std::string_view::npos) return true;
  }
  return xacro::has_xacro(*tree.root);
}

XacroResult expand_xacro(XmlTree source, const std::filesystem::path& file,
                         const std::vector<std::pair<std::string, std::string>>& arguments,
                         const PackageResolver& resolver, Diagnostics& diagnostics) {
  return xacro::Expander(resolver, diagnostics).run(std::move(source), file, arguments);
}

XacroResult expand_xacro(const std::filesystem::path& file,
                         const std::vector<std::pair<std::string, std::string>>& arguments,
                         const PackageResolver& resolver, Diagnostics& diagnostics) {
  return expand_xacro(load_xml_tree(file.string(), XmlContent::content), file, arguments, resolver,
                      diagnostics);
}

}  // namespace doppel
