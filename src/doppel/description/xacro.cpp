#include "doppel/description/xacro.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>

#include "doppel/core/names.h"
#include "doppel/description/xacro_detail.h"
#include "doppel/description/xacro_macro.h"

namespace doppel {
namespace xacro {
namespace {

namespace fs = std::filesystem;

// Where an expansion stands: within which call or include, and how deep.
struct Context {
  std::shared_ptr<const SourceLocation::Within> within;
  int depth = 0;
};

class Expander {
 public:
  Expander(const PackageResolver& resolver, Diagnostics& diagnostics)
      : diagnostics_(diagnostics), interpreter_(resolver, diagnostics), document_(interpreter_, nullptr) {}

  XacroResult run(XmlNode root, const fs::path& file,
                  const std::vector<std::pair<std::string, std::string>>& arguments) {
    for (const auto& [name, value] : arguments) {
      if (!value.empty()) interpreter_.set_argument(name, value);
    }
    interpreter_.files().push_back(file);
    find_prefixes(root);
    XacroResult out;
    const Context context;
    out.root.name = root.name;
    out.root.where = root.where;
    for (const XmlAttribute& a : root.attributes) {
      if (!is_declaration(a.name))
        out.root.attributes.push_back(
            {a.name, interpreter_.text(a.value, document_, a.where).str(), a.where});
    }
    children(root, document_, context, out.root.children);
    out.files = interpreter_.files();
    out.declared_arguments = declared_;
    out.used_arguments.assign(interpreter_.used_arguments().begin(), interpreter_.used_arguments().end());
    return out;
  }

 private:
  using Nodes = std::vector<XmlNode>;
  using Handler = void (Expander::*)(const XmlNode&, Scope&, const Context&, Nodes&);

  // At least four URIs are in use, and some files declare none: the prefix counts.
  void find_prefixes(const XmlNode& root) {
    for (const XmlAttribute& a : root.attributes) {
      if (a.name.starts_with("xmlns:") && a.value.find("xacro") != std::string::npos)
        prefixes_.insert(a.name.substr(6) + ":");
    }
  }
  [[nodiscard]] bool is_declaration(const std::string& attribute) const {
    return attribute.starts_with("xmlns:") && prefixes_.contains(attribute.substr(6) + ":");
  }
  // The name behind xacro's prefix; "" for other elements.
  [[nodiscard]] std::string command(const XmlNode& node) const {
    const std::size_t colon = node.name.find(':');
    if (colon == std::string::npos || !prefixes_.contains(node.name.substr(0, colon + 1))) return "";
    return node.name.substr(colon + 1);
  }

  static SourceLocation placed(SourceLocation where, const Context& context) {
    if (context.within) where.within = context.within;
    return where;
  }

  const XmlAttribute& required(const XmlNode& node, const char* name, const Context& context) const {
    if (const XmlAttribute* a = node.find(name)) return *a;
    throw InputError("xacro.missing_attribute", placed(node.where, context),
                     fmt::format("<{}> has no attribute '{}'", node.name, name));
  }

  std::string value_of(const XmlAttribute& a, Scope& scope, const Context& context) {
    return interpreter_.text(a.value, scope, placed(a.where, context)).str();
  }

  void count_node(const XmlNode& node, const Context& context) {
    if (--interpreter_.budget().nodes < 0) {
      throw InputError("xacro.too_much", placed(node.where, context), "the expansion grows without end",
                       "look for a macro that calls itself or doubles its output");
    }
  }
  [[nodiscard]] Context deeper(const XmlNode& node, const Context& context, std::string what) const {
    if (context.depth >= interpreter_depth_) {
      throw InputError(
          "xacro.too_deep",
          placed(node.where, context).within ? outermost(placed(node.where, context)) : node.where,
          fmt::format("macros and includes are nested more than {} deep, {}", interpreter_depth_, what),
          "look for one that calls or includes itself without an end");
    }
    Context out;
    out.within = std::make_shared<SourceLocation::Within>(
        SourceLocation::Within{placed(node.where, context), std::move(what)});
    out.depth = context.depth + 1;
    return out;
  }
  // A run-away recursion is told by its first call, not by a hundred of them.
  static SourceLocation outermost(SourceLocation where) {
    while (where.within) where = SourceLocation(where.within->call);
    return where;
  }

  void children(const XmlNode& parent, Scope& scope, const Context& context, Nodes& out) {
    for (const XmlNode& child : parent.children) node(child, scope, context, out);
  }

  void node(const XmlNode& in, Scope& scope, const Context& context, Nodes& out) {
    count_node(in, context);
    if (in.kind == XmlNode::Kind::text) {
      XmlNode text = in;
      text.where = placed(in.where, context);
      if (in.text.find('$') != std::string::npos)
        text.text = interpreter_.text(in.text, scope, text.where).str();
      out.push_back(std::move(text));
      return;
    }
    const std::string name = command(in);
    if (name.empty()) return element(in, in.name, scope, context, out);
    static const std::map<std::string, Handler> handlers{
        {"property", &Expander::property},       {"macro", &Expander::macro},
        {"include", &Expander::include},         {"arg", &Expander::argument},
        {"if", &Expander::conditional},          {"unless", &Expander::conditional},
        {"insert_block", &Expander::insert},     {"call", &Expander::dynamic_call},
        {"element", &Expander::dynamic_element}, {"attribute", &Expander::stray_attribute}};
    if (const auto handler = handlers.find(name); handler != handlers.end()) {
      return (this->*handler->second)(in, scope, context, out);
    }
    call(in, name, scope, context, out);
  }

  void element(const XmlNode& in, const std::string& name, Scope& scope, const Context& context, Nodes& out) {
    XmlNode made;
    made.name = name;
    made.where = placed(in.where, context);
    for (const XmlAttribute& a : in.attributes) {
      if (is_declaration(a.name)) continue;
      const SourceLocation where = placed(a.where, context);
      made.attributes.push_back({a.name, interpreter_.text(a.value, scope, where).str(), where});
    }
    std::vector<XmlAttribute>* const outer = std::exchange(attributes_, &made.attributes);
    children(in, scope, context, made.children);
    attributes_ = outer;
    out.push_back(std::move(made));
  }

  void property(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void macro(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void include(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void argument(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void conditional(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void insert(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void dynamic_call(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void dynamic_element(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);
  void stray_attribute(const XmlNode& in, Scope& scope, const Context& context, Nodes& out);

  void call(const XmlNode& in, const std::string& name, Scope& scope, const Context& context, Nodes& out);
  void bind_attributes(const XmlNode& in, const Macro& macro, std::vector<std::string>& open, Scope& caller,
                       Scope& inner, const Context& context);
  void bind_blocks(const XmlNode& in, const Macro& macro, std::vector<std::string>& open, Scope& caller,
                   Scope& inner, const Context& context);
  void bind_defaults(const XmlNode& in, const Macro& macro, const std::vector<std::string>& open,
                     Scope& caller, Scope& inner, const Context& context);
  std::vector<fs::path> included_files(const std::string& name, const SourceLocation& where,
                                       bool optional) const;

  Diagnostics& diagnostics_;
  Interpreter interpreter_;
  Scope document_;
  std::set<std::string> prefixes_{"xacro:"};
  std::vector<std::string> declared_;
  std::vector<XmlAttribute>* attributes_ = nullptr;  // of the element being made, for <xacro:attribute>
  int interpreter_depth_ = Budget{}.deepest;
};

void Expander::property(const XmlNode& in, Scope& scope, const Context& context, Nodes& /*out*/) {
  const std::string name = value_of(required(in, "name", context), scope, context);
  const XmlAttribute *value = in.find("value"), *fallback = in.find("default"), *where_to = in.find("scope");
  if (const XmlAttribute* gone = in.find("remove");
      gone != nullptr && interpreter_.condition(gone->value, scope, placed(gone->where, context))) {
    scope.remove(name);
    return;
  }
  if (fallback != nullptr) {
    if (scope.knows(name)) return;
    value = fallback;
  }
  Scope* target = &scope;
  if (where_to != nullptr && where_to->value == "global") target = &scope.root();
  if (where_to != nullptr && where_to->value == "parent" && scope.parent() != nullptr)
    target = scope.parent();
  if (value == nullptr) {
    Nodes whole;
    for (const XmlNode& child : in.children) {
      whole.push_back(child);
      whole.back().where = placed(child.where, context);
    }
    Nodes first;
    for (const XmlNode& child : whole) {
      if (child.kind == XmlNode::Kind::element && first.empty()) first.push_back(child);
    }
    target->set_block("**" + name, {std::move(whole), false});
    target->set_block("*" + name, {std::move(first), false});
    return;
  }
  const SourceLocation where = placed(value->where, context);
  const XmlAttribute* lazy = in.find("lazy_eval");
  const bool now =
      target != &scope ||
      (lazy != nullptr && !interpreter_.condition(lazy->value, scope, placed(lazy->where, context)));
  if (now)
    target->set(name, interpreter_.text(value->value, scope, where));
  else
    target->set_text(name, value->value, where);
}

void Expander::macro(const XmlNode& in, Scope& scope, const Context& context, Nodes& /*out*/) {
  auto made = std::make_shared<Macro>();
  made->name = value_of(required(in, "name", context), scope, context);
  for (const std::string& prefix : prefixes_) {
    if (made->name.starts_with(prefix)) made->name.erase(0, prefix.size());
  }
  made->where = placed(in.where, context);
  if (const XmlAttribute* parameters = in.find("params")) {
    made->parameters = parse_parameters(parameters->value, placed(parameters->where, context));
  }
  made->body = in.children;
  scope.add_macro(std::move(made));
}

void Expander::argument(const XmlNode& in, Scope& scope, const Context& context, Nodes& /*out*/) {
  const std::string name = value_of(required(in, "name", context), scope, context);
  declared_.push_back(name);
  const XmlAttribute* fallback = in.find("default");
  if (fallback != nullptr && !interpreter_.has_argument(name))
    interpreter_.set_argument(name, value_of(*fallback, scope, context));
}

void Expander::conditional(const XmlNode& in, Scope& scope, const Context& context, Nodes& out) {
  const XmlAttribute& value = required(in, "value", context);
  const bool wanted = interpreter_.condition(value.value, scope, placed(value.where, context));
  if (wanted == (command(in) == "if")) children(in, scope, context, out);
}

void Expander::insert(const XmlNode& in, Scope& scope, const Context& context, Nodes& out) {
  const std::string name = value_of(required(in, "name", context), scope, context);
  const Scope::Block* block = scope.find_block("**" + name);
  if (block == nullptr) block = scope.find_block("*" + name);
  if (block == nullptr) {
    throw InputError(
        "xacro.undefined_block", placed(in.where, context), fmt::format("undefined block '{}'", name),
        "it has to be a block parameter (*name) of the macro, or a property with elements inside");
  }
  const Scope::Block copy = *block;
  for (const XmlNode& child : copy.nodes) {
    count_node(in, context);
    if (copy.evaluated)
      out.push_back(child);
    else
      node(child, scope, Context{child.where.within, context.depth}, out);
  }
}

void Expander::dynamic_call(const XmlNode& in, Scope& scope, const Context& context, Nodes& out) {
  XmlNode direct = in;
  std::erase_if(direct.attributes, [](const XmlAttribute& a) { return a.name == "macro"; });
  call(direct, value_of(required(in, "macro", context), scope, context), scope, context, out);
}

void Expander::dynamic_element(const XmlNode& in, Scope& scope, const Context& context, Nodes& out) {
  const XmlAttribute* name = in.find("xacro:name");
  const XmlAttribute& from = name != nullptr ? *name : required(in, "name", context);
  XmlNode direct = in;
  std::erase_if(direct.attributes, [&from](const XmlAttribute& a) { return a.name == from.name; });
  element(direct, value_of(from, scope, context), scope, context, out);
}

void Expander::stray_attribute(const XmlNode& in, Scope& scope, const Context& context, Nodes& /*out*/) {
  const std::string name = value_of(required(in, "name", context), scope, context);
  const XmlAttribute& value = required(in, "value", context);
  if (attributes_ != nullptr)
    attributes_->push_back({name, value_of(value, scope, context), placed(value.where, context)});
}

std::vector<fs::path> Expander::included_files(const std::string& name, const SourceLocation& where,
                                               bool optional) const {
  const fs::path path = interpreter_.relative_to(where, name);
  if (name.find_first_of("*?[") != std::string::npos) {
    std::vector<fs::path> out;
    glob_t found{};
    if (glob(path.c_str(), 0, nullptr, &found) == 0)
      out.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
    globfree(&found);
    return out;
  }
  std::error_code none;
  if (fs::is_regular_file(path, none)) return {path};
  if (optional) return {};
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(path.parent_path(), none))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  throw InputError("xacro.file_not_found", where,
                   fmt::format("the file '{}' does not exist{}", path.string(),
                               did_you_mean(path.filename().string(), names)));
}

void Expander::include(const XmlNode& in, Scope& scope, const Context& context, Nodes& out) {
  const XmlAttribute& filename = required(in, "filename", context);
  const XmlAttribute* optional = in.find("optional");
  const XmlAttribute* space = in.find("ns");
  const bool may_miss =
      optional != nullptr && interpreter_.condition(optional->value, scope, placed(optional->where, context));
  const SourceLocation where = placed(filename.where, context);
  for (const fs::path& file : included_files(value_of(filename, scope, context), where, may_miss)) {
    const Context inside = deeper(in, context, "in include");
    const XmlNode root = [&] {
      try {
        return load_xml(file.string());
      } catch (const InputError& problem) {
        Diagnostic told = problem.diagnostics().front();
        told.where.within = inside.within;
        throw InputError(told);
      }
    }();
    interpreter_.files().push_back(file);
    find_prefixes(root);
    if (space == nullptr) {
      children(root, scope, inside, out);
    } else {
      const auto inner = std::make_shared<Scope>(interpreter_, &scope);
      children(root, *inner, inside, out);
      scope.add_namespace(value_of(*space, scope, context), inner);
    }
  }
}

void Expander::bind_attributes(const XmlNode& in, const Macro& macro, std::vector<std::string>& open,
                               Scope& caller, Scope& inner, const Context& context) {
  for (const XmlAttribute& a : in.attributes) {
    const auto wanted = std::find(open.begin(), open.end(), a.name);
    if (wanted == open.end()) {
      if (is_declaration(a.name)) continue;
      std::vector<std::string> names;
      for (const Macro::Parameter& p : macro.parameters) names.push_back(p.name);
      throw InputError("xacro.unknown_parameter", placed(a.where, context),
                       fmt::format("the macro '{}' has no parameter '{}'{}", macro.name, a.name,
                                   did_you_mean(a.name, names)),
                       fmt::format("it is defined at {}", macro.where.place()));
    }
    open.erase(wanted);
    inner.set(a.name, interpreter_.text(a.value, caller, placed(a.where, context)));
  }
}

void Expander::bind_blocks(const XmlNode& in, const Macro& macro, std::vector<std::string>& open,
                           Scope& caller, Scope& inner, const Context& context) {
  Nodes given;
  for (const XmlNode& child : in.children) node(child, caller, context, given);
  std::erase_if(given, [](const XmlNode& n) { return n.kind != XmlNode::Kind::element; });
  std::size_t next = 0;
  for (const Macro::Parameter& p : macro.parameters) {
    if (!p.name.starts_with('*')) continue;
    if (next >= given.size()) {
      throw InputError("xacro.missing_block", placed(in.where, context),
                       fmt::format("the macro '{}' needs a block '{}'", macro.name, p.name),
                       fmt::format("write the element between <{}> and </{}>", in.name, in.name));
    }
    XmlNode block = std::move(given[next++]);
    std::erase(open, p.name);
    if (p.name.starts_with("**"))
      inner.set_block(p.name, {std::move(block.children), true});
    else
      inner.set_block(p.name, {Nodes{std::move(block)}, true});
  }
  if (next < given.size()) {
    throw InputError(
        "xacro.unused_block", given[next].where,
        fmt::format("the macro '{}' has no use for the block <{}>", macro.name, given[next].name),
        fmt::format("it is defined at {}", macro.where.place()));
  }
}

void Expander::bind_defaults(const XmlNode& in, const Macro& macro, const std::vector<std::string>& open,
                             Scope& caller, Scope& inner, const Context& context) {
  for (const std::string& name : open) {
    const auto parameter = std::find_if(macro.parameters.begin(), macro.parameters.end(),
                                        [&name](const Macro::Parameter& p) { return p.name == name; });
    const SourceLocation where = placed(in.where, context);
    try {
      if (parameter->forwards) {
        if (const auto value = caller.find(name)) {
          inner.set(name, *value);
          continue;
        }
      }
    } catch (const ExpressionError& problem) {
      throw InputError(problem.rule, where, problem.what());
    }
    if (!parameter->fallback) {
      throw InputError("xacro.missing_parameter", where,
                       fmt::format("the macro '{}' needs the parameter '{}'", macro.name, name),
                       fmt::format("write {}=\"...\"; it is defined at {}", name, macro.where.place()));
    }
    inner.set(name, interpreter_.text(*parameter->fallback, inner, where));
  }
}

void Expander::call(const XmlNode& in, const std::string& name, Scope& scope, const Context& context,
                    Nodes& out) {
  const std::shared_ptr<const Macro> macro = scope.find_macro(name);
  if (!macro) {
    std::vector<std::string> names;
    scope.macro_names(names);
    for (const char* known : {"property", "macro", "include", "arg", "if", "unless", "insert_block", "call",
                              "element", "attribute"})
      names.emplace_back(known);
    throw InputError("xacro.unknown_macro", placed(in.where, context),
                     fmt::format("unknown macro '{}'{}", name, did_you_mean(name, names)),
                     "macros have to be defined or included before they are called");
  }
  const Context inside = deeper(in, context, fmt::format("in macro '{}'", macro->name));
  Scope inner(interpreter_, &scope);
  std::vector<std::string> open;
  for (const Macro::Parameter& p : macro->parameters) open.push_back(p.name);
  bind_attributes(in, *macro, open, scope, inner, context);
  bind_blocks(in, *macro, open, scope, inner, context);
  bind_defaults(in, *macro, open, scope, inner, context);
  for (const XmlNode& child : macro->body) node(child, inner, inside, out);
}

}  // namespace
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
                         const PackageResolver& resolver, Diagnostics& diagnostics) {
  return xacro::Expander(resolver, diagnostics).run(std::move(root), file, arguments);
}

XacroResult expand_xacro(const std::filesystem::path& file,
                         const std::vector<std::pair<std::string, std::string>>& arguments,
                         const PackageResolver& resolver, Diagnostics& diagnostics) {
  return expand_xacro(load_xml(file.string()), file, arguments, resolver, diagnostics);
}

}  // namespace doppel
