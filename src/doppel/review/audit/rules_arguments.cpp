// xacro's arguments as the source declares and reads them. Expansion alone does not find these faults,
// because it fails or succeeds only for the values that were given.
#include <algorithm>
#include <map>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel::audit_rules {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxSwitches = 4;  // each costs two expansions

struct ArgumentUse {
  std::string name;
  SourceLocation where;
  bool declared_before = false;
  bool in_root = false;  // in an attribute of <robot>, which xacro evaluates before anything else
};

bool is_condition(const XmlNode& node) {
  return node.is("xacro:if") || node.is("xacro:unless");
}

// One walk through the source in document order, includes in their place.
class Arguments {
 public:
  explicit Arguments(const std::vector<fs::path>& files) {
    for (const fs::path& file : files) {
      try {
        if (file.extension() == ".yaml" || file.extension() == ".yml") {
          continue;
        }
        sources_.emplace(file.lexically_normal(), load_xml(file.string()));
      } catch (const InputError&) {
        complete = false;
      }
    }
    if (files.empty()) return;
    const auto main = sources_.find(files.front().lexically_normal());
    if (main == sources_.end()) return;
    for (const XmlAttribute& attribute : main->second.attributes) {
      read(attribute.value, attribute.where, false);
    }
    for (auto& [name, use] : used) use.in_root = true;
    walk(main->first, main->second);
  }

  std::map<std::string, SourceLocation> declared;
  std::map<std::string, ArgumentUse> used;  // the first use of each
  std::string conditions;                   // the texts of all <xacro:if> and <xacro:unless>
  bool complete = true;                     // every include was followed

 private:
  // Each file once: a second pass finds nothing new, and files of one name would include each other forever.
  void walk(const fs::path& file, const XmlNode& root) {
    if (seen_.insert(file).second) visit(root, false);
  }

  void visit(const XmlNode& node, bool in_macro) {
    if (node.kind == XmlNode::Kind::text) {
      read(node.text, node.where, in_macro);
      return;
    }
    for (const XmlAttribute& attribute : node.attributes) {
      read(attribute.value, attribute.where, in_macro);
      if (is_condition(node)) conditions += attribute.value;
    }
    const bool macro = in_macro || node.is("xacro:macro");
    if (node.is("xacro:arg")) {
      if (const XmlAttribute* name = node.find("name")) declared.emplace(name->value, node.where);
    }
    if (node.is("xacro:include")) include(node);
    for (const XmlNode& child : node.children) visit(child, macro);
  }

  // The included file is the one that was read and has this name; a name with an expression in
  // it matches none.
  void include(const XmlNode& node) {
    const XmlAttribute* filename = node.find("filename");
    if (filename == nullptr) return;
    const std::string leaf = fs::path(filename->value).filename().string();
    bool followed = false;
    for (const auto& [file, root] : sources_) {
      if (file.filename().string() != leaf) continue;
      followed = true;
      walk(file, root);
    }
    complete = complete && followed;
  }

  void read(const std::string& text, const SourceLocation& where, bool in_macro) {
    constexpr std::string_view kArgumentStart = "$(arg ";
    for (std::size_t at = text.find(kArgumentStart); at != std::string::npos;
         at = text.find(kArgumentStart, at + 1)) {
      const std::size_t end = text.find(')', at);
      if (end == std::string::npos) return;
      std::string name = text.substr(at + kArgumentStart.size(), end - at - kArgumentStart.size());
      std::erase(name, ' ');
      if (name.empty() || name.find_first_of("${(") != std::string::npos) continue;
      used.emplace(name, ArgumentUse{name, where, in_macro || declared.contains(name)});
    }
    // Python's way: xacro.arg('name')
    constexpr std::string_view kCall = "xacro.arg(";
    for (std::size_t at = text.find(kCall); at != std::string::npos; at = text.find(kCall, at + 1)) {
      const std::size_t from = text.find_first_of("'\"", at);
      const std::size_t end = from == std::string::npos ? from : text.find_first_of("'\"", from + 1);
      if (end == std::string::npos) return;
      const std::string name = text.substr(from + 1, end - from - 1);
      used.emplace(name, ArgumentUse{name, where, true});
    }
  }

  std::map<fs::path, XmlNode> sources_;
  std::set<fs::path> seen_;
};

void check_declared(const Arguments& arguments, Findings& out) {
  Names declared;
  for (const auto& [name, where] : arguments.declared) declared.push_back(name);
  for (const auto& [name, use] : arguments.used) {
    const auto found = arguments.declared.find(name);
    if (found == arguments.declared.end()) {
      if (!arguments.complete) continue;
      // A required argument is a matter of style; a required switch is easily forgotten.
      out.add(
          "xacro.argument_undeclared", switches_simulation(name) ? Severity::warning : Severity::note,
          fmt::format("xacro argument '{}'", name), use.where,
          fmt::format("'$(arg {})' is used, but no <xacro:arg> declares it{}", name,
                      did_you_mean(name, declared)),
          fmt::format("add <xacro:arg name=\"{}\" default=\"...\"/> before the includes that use it", name));
    } else if (use.in_root) {
      out.add("xacro.argument_late", Severity::note, fmt::format("xacro argument '{}'", name), use.where,
              fmt::format("<robot> itself uses '$(arg {})', and its attributes are evaluated before any "
                          "declaration: the default never applies",
                          name),
              "write a fixed name, or always pass the argument");
    } else if (!use.declared_before) {
      out.add("xacro.argument_late", fmt::format("xacro argument '{}'", name), found->second,
              fmt::format("'$(arg {})' is used at {}, before this declaration", name, use.where.place()),
              "move the declaration up, before its first use");
    }
  }
}

void check_unused(const Arguments& arguments, Findings& out) {
  if (!arguments.complete) return;
  for (const auto& [name, where] : arguments.declared) {
    if (arguments.used.contains(name)) continue;
    const bool switches = switches_simulation(name);
    out.add("xacro.argument_unused", switches ? Severity::warning : Severity::note,
            fmt::format("xacro argument '{}'", name), where,
            switches
                ? fmt::format(
                      "'{}' is declared but not used: simulation and hardware get the same description", name)
                : fmt::format("'{}' is declared but not used", name),
            fmt::format("read it with $(arg {}), or remove it", name));
  }
}

// Checks that the switch has an effect: both expansions are compared, where the defaults suffice for them.
void check_switches(const AuditInput& in, const Arguments& arguments, Findings& out) {
  int tried = 0;
  for (const auto& [name, where] : arguments.declared) {
    if (!switches_simulation(name) || !arguments.used.contains(name)) continue;
    // A switch in a condition has an effect; only one that is passed on is compared.
    if (arguments.conditions.find("$(arg " + name + ")") != std::string::npos) continue;
    if (++tried > kMaxSwitches) return;
    try {
      PackageResolver resolver = in.resolver;
      Diagnostics ignored;
      const auto with = expand_description(in.expanded.file, {{name, "true"}}, resolver, ignored);
      const auto without = expand_description(in.expanded.file, {{name, "false"}}, resolver, ignored);
      if (to_xml(with.root) != to_xml(without.root)) continue;
    } catch (const InputError&) {
      continue;  // it takes other values, or other arguments are needed
    }
    out.add("xacro.switch_idle", fmt::format("xacro argument '{}'", name), where,
            fmt::format("{0}:=true and {0}:=false give the same description", name),
            "select the plugin of <ros2_control> by it, or remove it");
  }
}

}  // namespace

void check_arguments(const AuditInput& in, Findings& out) {
  if (!in.expanded.was_xacro) return;
  const Arguments arguments(in.expanded.files);
  check_declared(arguments, out);
  check_unused(arguments, out);
  check_switches(in, arguments, out);
}

}  // namespace doppel::audit_rules
