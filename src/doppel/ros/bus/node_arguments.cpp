#include "doppel/ros/bus/node_arguments.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/ros/bus/detail/ros_arguments.h"

namespace doppel {
namespace {

constexpr const char* kBegin = "--ros-args";

bool renames_node(std::string_view rule) {
  return rule.starts_with("__node:=") || rule.starts_with("__name:=");
}

// "arm:x:=y" -> "x:=y", where "arm" is among `own`.
std::string without_node(const std::string& rule, const std::vector<std::string>& own) {
  const std::size_t colon = rule.find(':');
  if (colon == rule.find(":=") || rule.compare(colon, 3, "://") == 0) return rule;
  const std::string node = rule.substr(0, colon);
  if (std::ranges::find(own, node) != own.end()) return rule.substr(colon + 1);
  throw InputError("node.arguments", {},
                   fmt::format("the rule '{}' is for a node '{}', but these arguments apply to '{}' only",
                               rule, node, own.front()),
                   fmt::format("write -r {}, or pass it where the twin is started", rule.substr(colon + 1)));
}

}  // namespace

NodeArguments read_node_arguments(std::vector<std::string> words, std::string_view full_name,
                                  NameRules names) {
  if (std::ranges::find(words, kBegin) == words.end()) words.insert(words.begin(), kBegin);
  std::vector<std::string> rules;
  RosArguments read = bus_detail::take_ros_arguments(words, NameRules(true), rules);
  if (!words.empty())
    throw InputError("node.arguments", {}, fmt::format("'{}' is not a ROS 2 argument", words.front()),
                     fmt::format("put all arguments after {}", kBegin));
  const char* of_the_process = read.log_level ? "--log-level" : read.enclave ? "--enclave" : nullptr;
  if (of_the_process != nullptr)
    throw InputError(
        "node.arguments", {}, fmt::format("{} is for the whole process, not for one node", of_the_process),
        "pass it when starting the twin; the log level of a node is set by its service ~/set_logger_levels");
  NodeArguments out;
  out.parameters = std::move(read.parameters);
  const std::string name = node_base_name(full_name);
  // A node's new name applies to all other rules, independent of their order.
  for (const std::string& rule : rules) {
    const std::string own = without_node(rule, {name, node_base_name(read.names.node(full_name))});
    if (renames_node(own)) out.rules.push_back(name + ":" + own);
  }
  for (const std::string& rule : out.rules) names.add(rule);
  const std::string now = node_base_name(names.node(full_name));
  for (const std::string& rule : rules) {
    const std::string own = without_node(rule, {name, now});
    if (!renames_node(own)) out.rules.push_back(now + ":" + own);
  }
  return out;
}

}  // namespace doppel
