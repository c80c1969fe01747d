#include <algorithm>

#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"

namespace doppel::app {
namespace {

struct NodeOptions {
  std::string node;
  bool hidden = false, count = false;
};

int list(Shell& shell, const NodeOptions& options) {
  const std::vector<std::string> names = node_names(shell.twin(), options.hidden);
  if (options.count) {
    say("{}\n", names.size());
    return 0;
  }
  for (const std::string& name : names) say("{}\n", name);
  return 0;
}

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

constexpr std::string_view kSendGoal = "/_action/send_goal";

int info(Shell& shell, const NodeOptions& options) {
  Client& twin = shell.twin();
  const std::string node = find_node_name(twin, options.node);
  const auto shown = [&](const std::string& name) { return options.hidden || !is_hidden(name); };
  say("{}\n  Subscribers:\n", node);
  for (const auto& [name, topic] : twin.topics()) {
    if (has(topic.subscribers, node) && shown(name)) say("    {}: {}\n", name, topic.type);
  }
  say("  Publishers:\n");
  for (const auto& [name, topic] : twin.topics()) {
    if (has(topic.publishers, node) && shown(name)) say("    {}: {}\n", name, topic.type);
  }
  say("  Service Servers:\n");
  for (const auto& [name, service] : twin.services()) {
    if (has(service.providers, node) && shown(name)) say("    {}: {}\n", name, service.type);
  }
  say("  Action Servers:\n");
  for (const auto& [name, service] : twin.services()) {
    if (!has(service.providers, node) || !name.ends_with(kSendGoal)) continue;
    say("    {}: {}\n", name.substr(0, name.size() - kSendGoal.size()),
        service.type.substr(0, service.type.rfind("_SendGoal")));
  }
  return 0;
}

}  // namespace

void add_node(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "node", "The nodes of the twin");
  add_verb<NodeOptions>(
      group, "list", "The nodes there are", "doppel node list", exit_code,
      [](CLI::App& verb, NodeOptions& options) {
        verb.add_flag("-a,--all", options.hidden, "Hidden ones (other shells) too");
        verb.add_flag("-c,--count-nodes", options.count, "Only their number");
      },
      list);
  add_verb<NodeOptions>(
      group, "info", "What a node publishes, hears and serves", "doppel node info /controller_manager",
      exit_code,
      [](CLI::App& verb, NodeOptions& options) {
        verb.add_option("node", options.node, "Name of the node")->required();
        verb.add_flag("--include-hidden", options.hidden, "Hidden topics and services too");
      },
      info);
}

}  // namespace doppel::app
