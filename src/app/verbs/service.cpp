#include <algorithm>

#include "app/number_checks.h"
#include "app/verbs/message_echo.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"

namespace doppel::app {
namespace {

struct ServiceOptions {
  std::string name, second, third;
  bool types = false, hidden = false, count = false, verbose = false;
  double timeout = 10;
};

int list_services(Shell& shell, const ServiceOptions& options) {
  std::size_t count = 0;
  for (const auto& [name, service] : shell.twin().services()) {
    if (is_hidden(name) && !options.hidden) continue;
    ++count;
    if (options.count) continue;
    print_line("{}", options.types ? fmt::format("{} [{}]\n", name, service.type) : name + "\n");
  }
  if (options.count) print_line("{}\n", count);
  return 0;
}

int print_service_type(Shell& shell, const ServiceOptions& options) {
  print_line("{}\n", shell.twin().find_service(absolute(options.name)).type);
  return 0;
}

// The ends of a service as rclpy prints a ServiceEndpointInfo: those of one node together, of its requests
// and of its replies. A twin's own server has no endpoints to list.
void print_ends(const std::vector<Client::Endpoint>& ends, const char* kind) {
  std::vector<std::string> nodes;
  for (const Client::Endpoint& end : ends) {
    if (std::ranges::find(nodes, end.node) == nodes.end()) nodes.push_back(end.node);
  }
  for (const std::string& node : nodes) {
    std::string gids, qos;
    std::size_t count = 0;
    for (const Client::Endpoint& end : ends) {
      if (end.node != node) continue;
      if (count++ == 0) {
        const std::size_t slash = node.rfind('/');
        print_line("\nNode name: {}\nNode namespace: {}\nService type: {}\nEndpoint type: {}\n",
                   node.substr(slash + 1), slash == 0 ? "/" : node.substr(0, slash), end.type, kind);
      }
      gids += fmt::format("  - {}{}\n", end.gid, end.type_hash.empty() ? "" : " " + end.type_hash);
      const char* mark = "- ";
      for (const auto& [name, value] : end.qos) {
        qos += fmt::format("  {}{}: {}\n", mark, name, value);
        mark = "  ";
      }
    }
    print_line("Endpoint count: {}\nGIDs and type hashes:\n{}QoS profiles:\n{}", count, gids, qos);
  }
}

int show_service(Shell& shell, const ServiceOptions& options) {
  const Client::Service& service = shell.twin().find_service(absolute(options.name));
  print_line("Type: {}\nClients count: {}\nServices count: {}\n", service.type, service.clients.size(),
             service.providers.size());
  if (!options.verbose) return 0;
  print_ends(service.client_ends, "CLIENT");
  print_ends(service.server_ends, "SERVER");
  return 0;
}

int find_services(Shell& shell, const ServiceOptions& options) {
  for (const auto& [name, service] : shell.twin().services()) {
    if (service.type == options.name) print_line("{}\n", name);
  }
  return 0;
}

const ServiceSupport& known_service(const std::string& type) {
  if (const ServiceSupport* support = find_service(type)) return *support;
  throw_usage_error(
      fmt::format("'{}' is not a known service type{}", type, did_you_mean(type, service_names())),
      "'doppel interface list' prints all of them");
}

struct ServiceEchoOptions {
  std::string name, type;
  EchoAllOptions echo;
};

// A service's type is not asked for: the events have their own.
int echo_service(Shell& shell, const ServiceEchoOptions& options) {
  const std::string name = absolute(options.name);
  const Client::Service& service = shell.twin().find_service(name);
  if (!options.type.empty() && known_service(options.type).name != service.type)
    throw_usage_error(fmt::format("{} has type {}, not {}", name, service.type, options.type));
  return echo_all(shell, {{name + "/_service_event", "", true}}, options.echo);
}

// "std_srvs/srv/Trigger" or its short form, rather than YAML.
bool looks_like_type(const std::string& text) {
  return text.find('/') != std::string::npos && std::ranges::all_of(text, [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '_' || c == '/';
         });
}

int call_service(Shell& shell, const ServiceOptions& options) {
  const std::string name = absolute(options.name);
  const bool typed = looks_like_type(options.second);
  const ServiceSupport* support = typed ? &known_service(options.second) : nullptr;
  const std::string& yaml = typed ? options.third : options.second;
  if (!typed && !options.third.empty())
    throw_usage_error(fmt::format("'{}' is not a service type", options.second));
  Client& twin = shell.twin();
  const Client::Service& service = twin.find_service(name);
  if (support == nullptr) support = find_service(service.type);
  if (support == nullptr)
    throw ClientError(fmt::format("{} is a {}, which is unknown to doppel", name, service.type));
  if (support->name != service.type)
    throw_usage_error(fmt::format("{} has type {}, not {}", name, service.type, support->name));
  const Bytes request = to_request(*support->request, yaml.empty() ? "{}" : yaml);
  const Bytes response = call_raw(
      twin, name, request, std::chrono::milliseconds(static_cast<std::int64_t>(options.timeout * 1000)));
  std::string text;
  if (const Status status = support->response->cdr_to_yaml(response, text); !status)
    throw ClientError(status.why());
  print_line("{}", text);
  return 0;
}

void add_service_echo(CLI::App& group, int& exit_code) {
  add_verb<ServiceEchoOptions>(
      group, "echo", "Print the calls of a service as they come, if its node publishes their events",
      "doppel param set /gazebo service_introspection contents\n"
      "  doppel service echo /controller_manager/switch_controller",
      exit_code,
      [](CLI::App& verb, ServiceEchoOptions& options) {
        verb.add_option("service", options.name, "Service name")->required();
        verb.add_option("type", options.type, "Service type (optional)");
        add_echo_options(verb, options.echo);
      },
      echo_service);
}

}  // namespace

void add_service(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "service", "List and call services",
                              "doppel service list -t\n  doppel service call /gazebo/pause_physics");
  add_verb<ServiceOptions>(
      group, "list", "List services", "doppel service list -t", exit_code,
      [](CLI::App& verb, ServiceOptions& options) {
        verb.add_flag("-t,--show-types", options.types, "Show their types");
        verb.add_flag("-c,--count-services", options.count, "Print only their number");
        verb.add_flag("-a,--include-hidden-services", options.hidden, "Include those of actions");
      },
      list_services);
  add_verb<ServiceOptions>(
      group, "type", "Print the type of a service", "doppel service type /gazebo/pause_physics", exit_code,
      [](CLI::App& verb, ServiceOptions& options) {
        verb.add_option("service", options.name, "Service name")->required();
      },
      print_service_type);
  add_verb<ServiceOptions>(
      group, "info", "Print type, servers and clients of a service",
      "doppel service info /controller_manager/list_controllers\n"
      "  doppel --remote service info -v /controller_manager/list_controllers",
      exit_code,
      [](CLI::App& verb, ServiceOptions& options) {
        verb.add_option("service", options.name, "Service name")->required();
        verb.add_flag("-v,--verbose", options.verbose,
                      "Show nodes, type hashes and QoS of the ends (with --remote)");
      },
      show_service);
  add_verb<ServiceOptions>(
      group, "find", "List the services of a type", "doppel service find std_srvs/srv/Empty", exit_code,
      [](CLI::App& verb, ServiceOptions& options) {
        verb.add_option("type", options.name, "Service type")->required();
      },
      find_services);
  add_service_echo(group, exit_code);
  add_verb<ServiceOptions>(
      group, "call", "Call a service and print its response",
      R"(doppel service call /gazebo/apply_joint_effort gazebo_msgs/srv/ApplyJointEffort \
    '{joint_name: "Revolute 1", effort: 0.01, duration: {sec: 1}}'
  doppel service call /gazebo/pause_physics          # the type is optional)",
      exit_code,
      [](CLI::App& verb, ServiceOptions& options) {
        verb.add_option("service", options.name, "Service name")->required();
        verb.add_option("type", options.second, "Service type (optional)");
        verb.add_option("values", options.third, "Request as YAML");
        verb.add_option("--timeout", options.timeout, "Seconds to wait for the response (default 10)")
            ->check(positive_number());
      },
      call_service);
}

}  // namespace doppel::app
