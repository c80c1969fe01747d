// Names that one tool accepts and another rewrites or rejects.
#include <algorithm>
#include <cctype>
#include <map>

#include "doppel/base/core/text.h"
#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {
namespace {

struct Named {
  const char* kind;
  const std::string* name;
  SourceLocation where;
  [[nodiscard]] std::string subject() const { return fmt::format("{} '{}'", kind, *name); }
};

std::vector<Named> all_names(const RobotDescription& robot) {
  std::vector<Named> out;
  for (const Link& link : robot.links) out.push_back({"link", &link.name, link.source});
  for (const Joint& joint : robot.joints) out.push_back({"joint", &joint.name, joint.source});
  return out;
}

bool plain(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == ' ';
}

// One finding for all: usually all names of a description have spaces.
void check_spaces(const std::vector<Named>& names, Findings& out) {
  std::vector<std::string> spaced;
  const Named* first = nullptr;
  for (const Named& n : names) {
    if (n.name->find(' ') == std::string::npos) continue;
    if (first == nullptr) first = &n;
    spaced.push_back(*n.name);
  }
  if (first == nullptr) return;
  out.add("name.space", spaced.size() == 1 ? first->subject() : fmt::format("{} names", spaced.size()),
          first->where,
          fmt::format("{} {}", names_of(spaced), spaced.size() == 1 ? "has a space" : "have spaces"));
}

void check_characters(const Named& n, Findings& out) {
  const std::string& name = *n.name;
  if (name.empty()) {
    out.add("name.empty", fmt::format("a {}", n.kind), n.where, fmt::format("a {} has no name", n.kind));
    return;
  }
  if (std::isspace(static_cast<unsigned char>(name.front())) != 0 ||
      std::isspace(static_cast<unsigned char>(name.back())) != 0) {
    out.add("name.blank_edge", n.subject(), n.where, "its name begins or ends with a space");
  }
  if (name.find("::") != std::string::npos || (name.starts_with("__") && name.ends_with("__"))) {
    out.add("name.reserved", n.subject(), n.where,
            "SDF reserves names with '::' and names between double underscores");
  } else if (name.front() == '/') {
    out.add("name.slash", n.subject(), n.where, "its name begins with '/'");
  }
}

// The first character of the name that is neither a letter, a digit nor harmless; empty: none.
std::string odd_character(const std::string& name) {
  const auto odd = std::find_if_not(name.begin() + (name.starts_with('/') ? 1 : 0), name.end(), plain);
  if (odd == name.end() || name.find("::") != std::string::npos) return "";
  return static_cast<unsigned char>(*odd) < 128 ? fmt::format("'{}'", *odd) : "a character that is not ASCII";
}

// One finding for each character: a prefix with a slash is part of every name.
void check_odd_characters(const std::vector<Named>& names, Findings& out) {
  std::map<std::string, std::vector<const Named*>> by_character;
  for (const Named& n : names) {
    const std::string odd = odd_character(*n.name);
    if (!odd.empty()) by_character[odd].push_back(&n);
  }
  for (const auto& [odd, holders] : by_character) {
    const bool harmful =
        odd.size() > 3 || std::string_view(".\t\n\"'\\$<>|&;*?").find(odd[1]) != std::string_view::npos;
    std::vector<std::string> listed;
    for (const Named* n : holders) listed.push_back(*n->name);
    out.add("name.character", harmful ? Severity::warning : Severity::note,
            listed.size() == 1 ? holders.front()->subject() : fmt::format("{} names", listed.size()),
            holders.front()->where,
            fmt::format("{} {} {}", names_of(listed), listed.size() == 1 ? "holds" : "hold", odd));
  }
}

void check_case(const std::vector<Named>& names, Findings& out) {
  std::map<std::string, const Named*> seen;
  for (const Named& n : names) {
    const auto [first, fresh] = seen.emplace(fmt::format("{} {}", n.kind, lowered(*n.name)), &n);
    if (fresh || *first->second->name == *n.name) continue;
    out.add("name.case", n.subject(), n.where,
            fmt::format("it differs from '{}' only in case", *first->second->name));
  }
}

void check_shared_names(const RobotDescription& robot, Findings& out) {
  std::vector<std::string> shared;
  const Joint* first = nullptr;
  for (const Joint& joint : robot.joints) {
    if (robot.find_link(joint.name) == nullptr) continue;
    if (first == nullptr) first = &joint;
    shared.push_back(joint.name);
  }
  if (first == nullptr) return;
  out.add("name.link_and_joint",
          shared.size() == 1 ? subject(*first) : fmt::format("{} joints", shared.size()), first->source,
          fmt::format("a link and a joint share the name {}", names_of(shared)));
}

void check_robot(const RobotDescription& robot, Findings& out) {
  const std::string& name = robot.name;
  const bool illegal =
      std::any_of(name.begin(), name.end(), [](char c) { return !plain(c) || c == ' ' || c == '-'; }) ||
      (!name.empty() && std::isdigit(static_cast<unsigned char>(name.front())) != 0);
  if (!illegal) return;
  out.add("name.robot", "the robot", robot.source,
          fmt::format("'{}' is not a valid name of a ROS node, topic or namespace", name));
}

}  // namespace

void check_names(const AuditInput& in, Findings& out) {
  const std::vector<Named> names = all_names(in.robot);
  check_robot(in.robot, out);
  check_spaces(names, out);
  for (const Named& n : names) check_characters(n, out);
  check_odd_characters(names, out);
  check_case(names, out);
  check_shared_names(in.robot, out);
}

}  // namespace doppel::audit_rules
