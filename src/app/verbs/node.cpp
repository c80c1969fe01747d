#include <algorithm>

#include "app/verbs/goals.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"

namespace doppel::app {
namespace {

struct NodeOptions {
  std::string node;
  bool hidden = false, count = false;
};

int list_nodes(Shell& shell, const NodeOptions& options) {
  const std::vector<std::string> names = node_names(shell.twin(), options.hidden);
  if (options.count) {
    print_line("{}\n", names.size());
    return 0;
  }
  for (const std::string& name : names) print_line("{}\n", name);
  return 0;
}

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

// The entries that list the node in `nodes`, each with its type; for actions their send_goal.
template <class Entry>
void print_part(const char* heading, const std::map<std::string, Entry>& entries,
                std::vector<std::string> Entry::*nodes, const std::string& node, bool hidden) {
  print_line("  {}:\n", heading);
  for (const auto& [name, entry] : entries) {
    if (has(entry.*nodes, node) && (hidden || !is_hidden(name))) print_line("    {}: {}\n", name, entry.type);
  }
}

void print_actions(const char* heading, Client& twin, std::vector<std::string> Client::Service::*nodes,
                   const std::string& node) {
  print_line("  {}:\n", heading);
  for (const auto& [name, service] : twin.services()) {
    if (!has(service.*nodes, node) || !name.ends_with(kSendGoal)) continue;
    print_line("    {}: {}\n", name.substr(0, name.size() - kSendGoal.size()),
               service.type.substr(0, service.type.rfind("_SendGoal")));
  }
}

int show_node(Shell& shell, const NodeOptions& options) {
  Client& twin = shell.twin();
  const std::string node = find_node_name(twin, options.node);
  const std::vector<std::string> all = twin.nodes();
  if (const auto count = std::ranges::count(all, node); count > 1)
    print_note(fmt::format("warning: {} nodes have the name {}; the output covers all of them", count, node));
  const bool hidden = options.hidden;
  print_line("{}\n", node);
  print_part("Subscribers", twin.topics(), &Client::Topic::subscribers, node, hidden);
  print_part("Publishers", twin.topics(), &Client::Topic::publishers, node, hidden);
  print_part("Service Servers", twin.services(), &Client::Service::providers, node, hidden);
  print_part("Service Clients", twin.services(), &Client::Service::clients, node, hidden);
  print_actions("Action Servers", twin, &Client::Service::providers, node);
  print_actions("Action Clients", twin, &Client::Service::clients, node);
  return 0;
}

}  // namespace

void add_node(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "node", "Show nodes of the twin or of the ROS 2 graph",
                              "doppel node list\n  doppel node info /controller_manager");
  add_verb<NodeOptions>(
      group, "list", "List nodes", "doppel node list", exit_code,
      [](CLI::App& verb, NodeOptions& options) {
        verb.add_flag("-a,--all", options.hidden, "Include hidden nodes (other shells)");
        verb.add_flag("-c,--count-nodes", options.count, "Print only their number");
      },
      list_nodes);
  add_verb<NodeOptions>(
      group, "info", "Print publishers, subscriptions, services and actions of a node",
      "doppel node info /controller_manager", exit_code,
      [](CLI::App& verb, NodeOptions& options) {
        verb.add_option("node", options.node, "Node name")->required();
        verb.add_flag("--include-hidden", options.hidden, "Include hidden topics and services");
      },
      show_node);
}

}  // namespace doppel::app
