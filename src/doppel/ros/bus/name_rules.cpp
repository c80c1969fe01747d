#include "doppel/ros/bus/name_rules.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxLength = 255;
constexpr std::string_view kTopicScheme = "rostopic://", kServiceScheme = "rosservice://";

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// One part between slashes.
Status check_token(std::string_view token, std::string_view whole, const char* what) {
  const auto refuse = [&](const std::string& why) {
    return Status::refused(fmt::format("'{}' is not a valid {}: {}", whole, what, why));
  };
  if (token.empty()) return refuse("it has an empty part between two slashes, or after the last");
  if (is_digit(token.front())) return refuse(fmt::format("'{}' begins with a digit", token));
  const auto bad = std::ranges::find_if(token, [](char c) { return !is_letter(c) && !is_digit(c); });
  if (bad == token.end()) return {};
  return refuse(fmt::format("it contains '{}'; letters, digits and _ are allowed", *bad));
}

Status check_tokens(std::string_view path, std::string_view whole, const char* what) {
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    if (Status fine = check_token(path.substr(begin, end - begin), whole, what); !fine) return fine;
    begin = end + 1;
  }
  return {};
}

[[noreturn]] void refuse_rule(std::string_view rule, const std::string& why, std::string fix) {
  throw InputError("cli.ros_args", {}, fmt::format("the rule '{}' {}", rule, why), std::move(fix));
}

void require(const Status& status, std::string_view rule, std::string fix) {
  if (!status) refuse_rule(rule, "cannot be used: " + status.why(), std::move(fix));
}

// "arm:x" -> "arm"; what remains is left in `match`.
std::string take_node(std::string_view& match) {
  const std::size_t colon = match.find(':');
  if (colon == std::string_view::npos || match.substr(colon).starts_with("://")) return "";
  const std::string node(match.substr(0, colon));
  match.remove_prefix(colon + 1);
  return node;
}

bool take_scheme(std::string_view& text, std::string_view scheme) {
  if (!text.starts_with(scheme)) return false;
  text.remove_prefix(scheme.size());
  return true;
}

std::vector<std::string> listed(const std::set<std::string>& names) {
  return {names.begin(), names.end()};
}

}  // namespace

std::string node_namespace(std::string_view full_name) {
  const std::size_t slash = full_name.find_last_of('/');
  return slash == std::string_view::npos || slash == 0 ? "/" : std::string(full_name.substr(0, slash));
}

std::string node_base_name(std::string_view full_name) {
  return std::string(full_name.substr(full_name.find_last_of('/') + 1));
}

std::string logger_name(std::string_view full_name) {
  std::string name(full_name.substr(full_name.starts_with('/') ? 1 : 0));
  std::ranges::replace(name, '/', '.');
  return name;
}

Status check_node_name(std::string_view name) {
  if (name.empty()) return Status::refused("a node name cannot be empty");
  if (name.size() > kMaxLength)
    return Status::refused(
        fmt::format("a node name has at most {} characters, this one has {}", kMaxLength, name.size()));
  return check_token(name, name, "node name");
}

Status check_namespace(std::string_view name) {
  if (name == "/") return {};
  if (!name.starts_with('/'))
    return Status::refused(fmt::format("'{}' is not a valid namespace: it must begin with a slash", name));
  return check_tokens(name.substr(1), name, "namespace");
}

Status check_topic_name(std::string_view name) {
  if (name.empty()) return Status::refused("a name cannot be empty");
  std::string_view rest = name;
  if (rest == "~") return {};
  if (rest.starts_with("~/")) {
    rest.remove_prefix(2);
  } else if (rest.starts_with('~')) {
    return Status::refused(fmt::format("'{}' is not a valid name: '~' must be followed by a slash", name));
  } else if (rest.starts_with('/')) {
    rest.remove_prefix(1);
  }
  return check_tokens(rest, name, "name");
}

std::string expand_name(std::string_view name, std::string_view node) {
  if (name == "~") return std::string(node);
  if (name.starts_with("~/")) return fmt::format("{}{}", node, name.substr(1));
  if (name.starts_with('/')) return std::string(name);
  const std::string space = node_namespace(node);
  return fmt::format("{}{}{}", space, space == "/" ? "" : "/", name);
}

void NameRules::add(std::string_view text, const Owner& owner) {
  const std::size_t arrow = text.find(":=");
  if (arrow == std::string_view::npos || arrow == 0)
    refuse_rule(text, "is not of the form FROM:=TO", "write for example -r joint_states:=arm/joint_states");
  Rule rule{std::string(text), "", Target::topic_and_service, "", std::string(text.substr(arrow + 2)), owner,
            owner.node};
  std::string_view match = text.substr(0, arrow);
  rule.node = take_node(match);
  if (match == "__node" || match == "__name") {
    if (rule.node.empty() && !one_node_)
      refuse_rule(text, "would give every node the same name",
                  fmt::format("select the node: -r robot_state_publisher:__node:={}", rule.to));
    require(check_node_name(rule.to), text, "use letters, digits and _ in a node name");
    rule.target = Target::node_name;
  } else if (match == "__ns") {
    require(check_namespace(rule.to), text, "write for example -r __ns:=/left");
    rule.target = Target::node_namespace;
  } else if (match.starts_with("__")) {
    refuse_rule(text,
                fmt::format("begins with '{}', which is unknown{}", match,
                            did_you_mean(match, std::vector<std::string>{"__ns", "__node", "__name"})),
                "the special names are __ns, __node and __name");
  } else {
    if (take_scheme(match, kTopicScheme)) rule.target = Target::topic;
    if (take_scheme(match, kServiceScheme)) rule.target = Target::service;
    require(check_topic_name(match), text, "FROM must be the name of a topic or service");
    require(check_topic_name(rule.to), text, "TO must be the name of a topic or service");
    rule.from = match;
  }
  if (!rule.node.empty()) require(check_node_name(rule.node), text, "write NODE:FROM:=TO");
  rules_.push_back(std::move(rule));
}

std::vector<std::string> NameRules::texts() const {
  std::vector<std::string> out;
  for (const Rule& rule : rules_) {
    if (rule.owner == Owner{}) out.push_back(rule.text);
  }
  return out;
}

void NameRules::remove(const Owner& owner) {
  std::erase_if(rules_, [&owner](const Rule& rule) { return rule.owner == owner; });
}

void NameRules::remove_all_of(const void* whose) {
  std::erase_if(rules_, [whose](const Rule& rule) { return rule.owner.whose == whose; });
}

std::string NameRules::node(std::string_view full_name) {
  std::string name = node_base_name(full_name), space = node_namespace(full_name);
  if (rules_.empty()) return std::string(full_name);
  nodes_.insert(name);
  const auto apply = [this, full_name](Target target, std::string& value, const std::string& who) {
    const auto rule = std::ranges::find_if(rules_, [&](const Rule& r) {
      return r.target == target && (r.node.empty() || r.node == who) &&
             (r.owner.node.empty() || r.owner.node == full_name);
    });
    if (rule == rules_.end()) return;
    rule->used = true;
    value = rule->to;
  };
  const std::string before = name;
  apply(Target::node_name, name, before);
  nodes_.insert(name);
  apply(Target::node_namespace, space, name);
  std::string out = (space == "/" ? "" : space) + "/" + name;
  for (Rule& rule : rules_) {
    if (rule.owner.node == full_name) rule.owners_node = out;
  }
  return out;
}

// node: its name by the rules.
bool NameRules::fits_node(const Rule& rule, std::string_view node) {
  if (!rule.owner.node.empty() && rule.owners_node != node) return false;
  return rule.node.empty() || rule.node == node_base_name(node);
}

bool NameRules::fits(const Rule& rule, NameKind kind) {
  return rule.target == Target::topic_and_service ||
         rule.target == (kind == NameKind::topic ? Target::topic : Target::service);
}

std::string NameRules::resolve(NameKind kind, std::string_view name, std::string_view node) {
  std::string whole = expand_name(name, node);
  if (rules_.empty()) return whole;
  names_.insert(std::string(name));
  names_.insert(whole);
  for (Rule& rule : rules_) {
    if (!fits(rule, kind) || !fits_node(rule, node)) continue;
    if (expand_name(rule.from, node) != whole) continue;
    rule.used = true;
    return expand_name(rule.to, node);
  }
  return whole;
}

void NameRules::report_unused(Diagnostics& diagnostics) const {
  for (const Rule& rule : rules_) {
    if (rule.used) continue;
    const bool unknown_node = !rule.node.empty() && !nodes_.contains(rule.node);
    diagnostics.warning("cli.rule_unused", {},
                        unknown_node
                            ? fmt::format("the rule '{}' renames nothing: there is no node '{}'{}", rule.text,
                                          rule.node, did_you_mean(rule.node, listed(nodes_)))
                            : fmt::format("the rule '{}' renames nothing: no node uses the name '{}'{}",
                                          rule.text, rule.from, did_you_mean(rule.from, listed(names_))),
                        "correct it, or remove it");
  }
}

}  // namespace doppel
