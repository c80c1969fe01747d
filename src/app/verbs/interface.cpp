#include <algorithm>
#include <set>

#include "app/verbs/field_value.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/near_names.h"

namespace doppel::app {
namespace {

struct ShowOptions {
  std::string type;
};

std::vector<std::string> all_types() {
  std::vector<std::string> names = type_names();
  for (const auto& more : {service_names(), action_names()})
    names.insert(names.end(), more.begin(), more.end());
  return names;
}

// A message's type; throws InputError with the nearest of all types.
const TypeSupport& known_interface(const std::string& name) {
  if (const TypeSupport* type = find_type(name)) return *type;
  throw_unknown_type(name, "type", all_types());
}

int show_interface(Shell&, const ShowOptions& options) {
  if (const ServiceSupport* service = find_service(options.type)) {
    print_line("{}---\n{}", show_type(*service->request->description()),
               show_type(*service->response->description()));
  } else if (const ActionSupport* action = find_action(options.type)) {
    print_line("{}---\n{}---\n{}", show_type(*action->goal->description()),
               show_type(*action->result->description()), show_type(*action->feedback->description()));
  } else {
    print_line("{}", show_type(*known_interface(options.type).description()));
  }
  return 0;
}

int list_interfaces(Shell&, const NoOptions&) {
  const auto print = [](const char* heading, const std::vector<std::string>& names) {
    print_line("{}:\n", heading);
    for (const std::string& name : names) print_line("    {}\n", name);
  };
  print("Messages", type_names());
  print("Services", service_names());
  print("Actions", action_names());
  return 0;
}

std::vector<std::string> packages() {
  std::set<std::string> out;
  for (const std::string& type : all_types()) out.insert(type.substr(0, type.find('/')));
  return {out.begin(), out.end()};
}

int list_packages(Shell&, const NoOptions&) {
  for (const std::string& package : packages()) print_line("{}\n", package);
  return 0;
}

int list_package(Shell&, const ShowOptions& options) {
  const std::vector<std::string> known = packages();
  if (std::ranges::find(known, options.type) == known.end()) {
    throw_usage_error(fmt::format("there is no package '{}' with interfaces{}", options.type,
                                  names_near(options.type, known)),
                      "'doppel interface packages' prints all of them");
  }
  for (const std::string& type : all_types()) {
    if (type.starts_with(options.type + "/")) print_line("{}\n", type);
  }
  return 0;
}

// A message with default values, as YAML that can be edited and sent.
int print_prototype(Shell&, const ShowOptions& options) {
  const ServiceSupport* const service = find_service(options.type);
  const ActionSupport* const action = find_action(options.type);
  const TypeSupport& type = service != nullptr  ? *service->request
                            : action != nullptr ? *action->goal
                                                : known_interface(options.type);
  std::string yaml;
  if (const Status status = type.cdr_to_yaml(to_request(type, "{}"), yaml); !status)
    throw ClientError(status.why());
  print_line("{}", yaml);
  return 0;
}

}  // namespace

void add_interface(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "interface", "Show message, service and action types",
                              "doppel interface show sensor_msgs/msg/JointState\n  doppel interface list");
  add_verb<ShowOptions>(
      group, "show", "Print the fields of a type", "doppel interface show sensor_msgs/msg/JointState",
      exit_code,
      [](CLI::App& verb, ShowOptions& options) {
        verb.add_option("type", options.type, "Type name")->required();
      },
      show_interface);
  add_verb<NoOptions>(
      group, "list", "List the known types", "doppel interface list", exit_code, [](CLI::App&, NoOptions&) {},
      list_interfaces);
  add_verb<NoOptions>(
      group, "packages", "List the packages of the known types", "doppel interface packages", exit_code,
      [](CLI::App&, NoOptions&) {}, list_packages);
  add_verb<ShowOptions>(
      group, "package", "List the types of a package", "doppel interface package sensor_msgs", exit_code,
      [](CLI::App& verb, ShowOptions& options) {
        verb.add_option("package", options.type, "Package name")->required();
      },
      list_package);
  add_verb<ShowOptions>(
      group, "proto", "Print a message, request or goal with default values, to be edited and sent",
      "doppel interface proto trajectory_msgs/msg/JointTrajectory", exit_code,
      [](CLI::App& verb, ShowOptions& options) {
        verb.add_option("type", options.type, "Type name")->required();
      },
      print_prototype);
}

}  // namespace doppel::app
