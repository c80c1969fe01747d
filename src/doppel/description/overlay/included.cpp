// The overlays beside included files: which names of the expanded description each of them refers to, in
// which order they are applied, and one line for what cannot be applied.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel {
namespace {

using namespace overlay_detail;
namespace fs = std::filesystem;

// A name that an operation refers to.
struct NamedElement {
  std::string kind, name;  // "joint" or "link"
  friend bool operator==(const NamedElement&, const NamedElement&) = default;
};

// An overlay and the files that it stands beside: arm.xacro and arm.urdf.xacro share one.
struct IncludedOverlay {
  fs::path file;
  std::vector<std::string>
      descriptions;  // as they are spelled in the places of the tree, the last one read last
};

bool may_have_overlay(const fs::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".xacro" || extension == ".urdf" || extension == ".xml";
}

fs::path canonical_path(const fs::path& file) {
  std::error_code none;
  fs::path out = fs::weakly_canonical(file, none);
  return none ? file : out;
}

// The overlays of included files in the order of reading; the description's own is not among them, whatever
// file shares it.
std::vector<IncludedOverlay> find_included_overlays(const ExpandedDescription& expanded) {
  std::vector<IncludedOverlay> out;
  const fs::path own = canonical_path(overlay_path(expanded.file));
  for (const fs::path& file : expanded.files) {
    std::error_code none;
    const fs::path beside = overlay_path(file);
    if (!may_have_overlay(file) || !fs::is_regular_file(beside, none)) continue;
    const fs::path identity = canonical_path(beside);
    if (identity == own) continue;
    const auto known = std::ranges::find_if(
        out, [&](const IncludedOverlay& one) { return canonical_path(one.file) == identity; });
    IncludedOverlay found{beside, {}};
    if (known != out.end()) {
      found = std::move(*known);
      out.erase(known);
    }
    found.descriptions.push_back(file.string());
    out.push_back(std::move(found));
  }
  return out;
}

// The files of a place: its own, then that of each call and include around it, to the outermost.
std::vector<std::string> files_of_place(const SourceLocation& where) {
  std::vector<std::string> out;
  for (const SourceLocation* at = &where; at != nullptr; at = at->within ? &at->within->call : nullptr) {
    if (at->file && (out.empty() || out.back() != *at->file)) out.push_back(*at->file);
  }
  return out;
}

bool is_from(const IncludedOverlay& overlay, const std::vector<std::string>& files) {
  return std::ranges::find_first_of(files, overlay.descriptions) != files.end();
}

// True if an element comes from `inner` by way of `outer`.
bool is_inside(const IncludedOverlay& inner, const IncludedOverlay& outer, const XmlNode& root) {
  return std::ranges::any_of(root.children, [&](const XmlNode& child) {
    const std::vector<std::string> files = files_of_place(child.where);
    const auto first = std::ranges::find_first_of(files, inner.descriptions);
    return first != files.end() &&
           std::ranges::find_first_of(std::next(first), files.end(), outer.descriptions.begin(),
                                      outer.descriptions.end()) != files.end();
  });
}

// The order of reading, except that an included file precedes the one that includes it: its overlay was
// written for the file alone, the outer one for the corrected result.
std::vector<IncludedOverlay> ordered_overlays(const ExpandedDescription& expanded) {
  std::vector<IncludedOverlay> waiting = find_included_overlays(expanded), out;
  while (!waiting.empty()) {
    const auto has_inner = [&](const IncludedOverlay& outer) {
      return std::ranges::any_of(waiting, [&](const IncludedOverlay& inner) {
        return &inner != &outer && is_inside(inner, outer, expanded.root);
      });
    };
    auto next = std::ranges::find_if_not(waiting, has_inner);
    if (next == waiting.end()) next = waiting.begin();  // macros that call each other
    out.push_back(std::move(*next));
    waiting.erase(next);
  }
  return out;
}

// The names that the operations expect to find, without those that earlier ones create.
std::vector<NamedElement> targets_of(const std::vector<Operation>& operations) {
  std::vector<NamedElement> out;
  std::set<std::string> created{"", "world"};
  for (const Operation& operation : operations) {
    const std::string kind = target_kind(operation.action), name = target_name(operation.action);
    if (std::holds_alternative<ScaleMasses>(operation.action)) {
      for (const auto& [link, mass] : operation.was) out.push_back({"link", link});
    } else if ((kind == "joint" || kind == "link") && !created.contains(name)) {
      out.push_back({kind, name});
    }
    if (const auto* renaming = std::get_if<Rename>(&operation.action)) created.insert(renaming->to);
  }
  return out;
}

// The text of the sources before their expansion: it distinguishes a prefix from a coincidence of names.
class WrittenValues {
 public:
  explicit WrittenValues(const ExpandedDescription& expanded) {
    for (const fs::path& file : expanded.files) {
      if (!may_have_overlay(file)) continue;
      try {
        collect(load_xml(file.string()));
      } catch (const InputError&) {
        continue;  // it was readable a moment ago: the reload reports it
      }
    }
  }

  // "left_" is a value in the sources (of a macro's parameter, an argument, a property), "left" one with a
  // separator.
  [[nodiscard]] bool has_prefix(const std::string& prefix) const {
    const std::size_t end = prefix.find_last_not_of("_-./");
    return values_.contains(prefix) ||
           (end != std::string::npos && values_.contains(prefix.substr(0, end + 1)));
  }
  // The element is written as name="${prefix}NAME".
  [[nodiscard]] bool is_written_with_prefix(const XmlNode& element, const std::string& name) const {
    const auto written = names_.find(element.where.place());
    if (written == names_.end() || !written->second.starts_with('$')) return false;
    const std::size_t end = written->second.find_last_of("})");
    return end != std::string::npos && written->second.substr(end + 1) == name;
  }

 private:
  void collect(const XmlNode& node) {
    for (const XmlAttribute& attribute : node.attributes) {
      values_.insert(attribute.value);
      if (attribute.name == "name") names_[node.where.place()] = attribute.value;
    }
    for (const XmlNode& child : node.children) collect(child);
  }

  std::set<std::string> values_;
  std::map<std::string, std::string> names_;  // "arm.xacro:12:3" -> "${prefix}elbow"
};

// The joints and links of a description that come from the files of an overlay.
std::vector<const XmlNode*> elements_from(const IncludedOverlay& overlay, const XmlNode& root) {
  std::vector<const XmlNode*> out;
  for (const XmlNode& child : root.children) {
    if ((child.is("joint") || child.is("link")) && is_from(overlay, files_of_place(child.where)))
      out.push_back(&child);
  }
  return out;
}

// The prefixes under which the targets are in the description, in its order. Only "" if any has its plain
// name.
std::vector<std::string> prefixes_of(const std::vector<NamedElement>& targets,
                                     const std::vector<const XmlNode*>& elements,
                                     const WrittenValues& written) {
  std::vector<std::string> out;
  for (const XmlNode* element : elements) {
    const std::string name = attribute_of(*element, "name");
    for (const NamedElement& target : targets) {
      if (target.kind != element->name || !name.ends_with(target.name)) continue;
      const std::string prefix = name.substr(0, name.size() - target.name.size());
      if (prefix.empty()) return {""};
      if (std::ranges::find(out, prefix) != out.end()) continue;
      if (written.has_prefix(prefix) || written.is_written_with_prefix(*element, target.name))
        out.push_back(prefix);
    }
  }
  return out;
}

void prepend(const std::string& prefix, std::string& name) {
  if (!name.empty() && name != "world" && name != kNone) name.insert(0, prefix);
}

Operation with_prefix(Operation operation, const std::string& prefix) {
  if (prefix.empty()) return operation;
  std::string target = target_name(operation.action);
  if (target_kind(operation.action) != "robot") {
    prepend(prefix, target);
    set_target(operation.action, target);
  }
  std::visit(Overloaded{
                 [&](AddMimic& a) { prepend(prefix, a.leader); },
                 [&](Rename& a) {
                   if (a.kind != "robot") prepend(prefix, a.to);
                 },
                 [&](AddRos2Control& a) {
                   for (std::string& joint : a.joints) prepend(prefix, joint);
                   for (auto& [joint, value] : a.initial_values) prepend(prefix, joint);
                 },
                 [](auto&) {},
             },
             operation.action);
  const bool masses = std::holds_alternative<ScaleMasses>(operation.action);
  for (auto& [key, value] : operation.was) {
    if (masses) prepend(prefix, key);
    if (key == "leader" || key == "joint" || key == "parent" || key == "child") prepend(prefix, value);
  }
  return operation;
}

// The place and the name of the robot belong to the file that includes it.
bool belongs_to_outer_file(const Operation& operation) {
  const auto* renaming = std::get_if<Rename>(&operation.action);
  return std::holds_alternative<AttachToWorld>(operation.action) ||
         (renaming != nullptr && renaming->kind == "robot");
}

std::string corrections(std::size_t count) {
  return fmt::format("{} correction{}", count, count == 1 ? "" : "s");
}

SourceLocation place_of(const Overlay& overlay) {
  return overlay.operations.empty() ? make_location(overlay.file.string()) : overlay.operations.front().where;
}

// One line for all operations without a target, in place of one for each.
void report_missing_targets(const AppliedOverlay& applied, Diagnostics& diagnostics) {
  std::size_t missing = 0;
  const std::string* first = nullptr;
  for (const OperationOutcome& outcome : applied.outcomes) {
    if (outcome.state != OperationState::no_target) continue;
    ++missing;
    if (first == nullptr) first = &outcome.message;
  }
  if (first == nullptr) return;
  diagnostics.warning("overlay.no_target", place_of(applied.overlay),
                      fmt::format("{} of {} beside the included '{}' cannot be applied here: {}{}", missing,
                                  corrections(applied.outcomes.size()), shown_path(applied.description),
                                  *first, missing > 1 ? ", for example" : ""),
                      "correct these names in the overlay of the including file");
}

AppliedOverlay apply_included(const IncludedOverlay& found, const Overlay& overlay, const std::string& prefix,
                              ExpandedDescription& description, const PackageResolver& resolver,
                              Diagnostics& diagnostics) {
  AppliedOverlay out;
  out.description = found.descriptions.back();
  out.prefix = prefix;
  out.included = true;
  out.overlay.file = found.file;
  for (const Operation& operation : overlay.operations)
    out.overlay.operations.push_back(with_prefix(operation, prefix));
  Diagnostics reported;
  out.outcomes = apply_overlay(out.overlay, description, resolver, reported);
  std::set<std::string> superseded;
  for (std::size_t i = 0; i < out.outcomes.size(); ++i) {
    OperationOutcome& outcome = out.outcomes[i];
    if (outcome.state != OperationState::changed || !belongs_to_outer_file(out.overlay.operations[i]))
      continue;
    outcome = {OperationState::superseded, "the including file decides this"};
    superseded.insert(out.overlay.operations[i].where.place());
  }
  for (const Diagnostic& one : reported.all()) {
    if (one.rule != "overlay.no_target" && !superseded.contains(one.where.place())) diagnostics.add(one);
  }
  report_missing_targets(out, diagnostics);
  const auto applied = static_cast<std::size_t>(
      std::ranges::count(out.outcomes, OperationState::applied, &OperationOutcome::state));
  if (applied > 0) {
    diagnostics.note(
        "overlay.included", place_of(out.overlay),
        fmt::format("{} of {} beside the included '{}' are applied{}", applied,
                    corrections(out.outcomes.size()), shown_path(out.description),
                    prefix.empty() ? "" : fmt::format(" to the names that begin with '{}'", prefix)));
  }
  return out;
}

// An overlay of which no name is found: nothing of the file is in the description, or its names differ.
AppliedOverlay apply_to_nothing(const IncludedOverlay& found, const Overlay& overlay,
                                const std::vector<const XmlNode*>& elements, Diagnostics& diagnostics) {
  AppliedOverlay out{found.descriptions.back(), "", true, overlay, {}};
  const std::string what = fmt::format("{} beside the included '{}' cannot be applied here: ",
                                       corrections(overlay.operations.size()), shown_path(out.description));
  std::string why;
  if (elements.empty()) {
    why = "no joint or link of the description comes from that file";
    diagnostics.note("overlay.included", place_of(overlay), what + why);
  } else {
    std::vector<std::string> names;
    for (const XmlNode* element : elements) names.push_back(attribute_of(*element, "name"));
    const std::vector<NamedElement> targets = targets_of(overlay.operations);
    why = fmt::format("there is no {} '{}'{}", targets.front().kind, targets.front().name,
                      did_you_mean(targets.front().name, names));
    diagnostics.warning(
        "overlay.no_target", place_of(overlay),
        fmt::format("{}{}, and no prefix of a macro's parameter leads to it", what, why),
        "write the corrections with this description's names into the overlay of the including file");
  }
  out.outcomes.assign(overlay.operations.size(), {OperationState::no_target, why});
  return out;
}

}  // namespace

std::vector<AppliedOverlay> apply_included_overlays(ExpandedDescription& description,
                                                    const PackageResolver& resolver,
                                                    Diagnostics& diagnostics) {
  std::vector<AppliedOverlay> out;
  const std::vector<IncludedOverlay> overlays = ordered_overlays(description);
  if (overlays.empty()) return out;
  const WrittenValues written(description);
  for (const IncludedOverlay& found : overlays) {
    const Overlay overlay = read_overlay(found.file);
    description.files.push_back(found.file);
    if (overlay.operations.empty()) continue;
    const std::vector<const XmlNode*> elements = elements_from(found, description.root);
    const std::vector<NamedElement> targets = targets_of(overlay.operations);
    std::vector<std::string> prefixes = prefixes_of(targets, elements, written);
    if (targets.empty() && !elements.empty()) prefixes = {""};  // for example only add_ros2_control
    if (prefixes.empty()) out.push_back(apply_to_nothing(found, overlay, elements, diagnostics));
    for (const std::string& prefix : prefixes)
      out.push_back(apply_included(found, overlay, prefix, description, resolver, diagnostics));
  }
  return out;
}

std::vector<AppliedOverlay> apply_overlays(ExpandedDescription& description, const PackageResolver& resolver,
                                           Diagnostics& diagnostics) {
  std::vector<AppliedOverlay> out = apply_included_overlays(description, resolver, diagnostics);
  std::error_code none;
  const fs::path own = overlay_path(description.file);
  if (!fs::exists(own, none)) return out;
  description.files.push_back(own);
  AppliedOverlay applied{description.file, "", false, read_overlay(own), {}};
  applied.overlay.file = own;
  applied.outcomes = apply_overlay(applied.overlay, description, resolver, diagnostics);
  out.push_back(std::move(applied));
  return out;
}

std::vector<fs::path> overlay_paths(const std::vector<fs::path>& files) {
  std::vector<fs::path> out;
  for (const fs::path& file : files) {
    if (may_have_overlay(file)) out.push_back(overlay_path(file));
  }
  return out;
}

}  // namespace doppel
