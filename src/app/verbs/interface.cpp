#include "app/verbs/field_value.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/core/names.h"

namespace doppel::app {
namespace {

struct ShowOptions {
  std::string type;
};

int show_interface(Shell&, const ShowOptions& options) {
  if (const ServiceSupport* service = find_service(options.type)) {
    print_line("{}---\n{}", show_type(*service->request->description()),
               show_type(*service->response->description()));
  } else if (const ActionSupport* action = find_action(options.type)) {
    print_line("{}---\n{}---\n{}", show_type(*action->goal->description()),
               show_type(*action->result->description()), show_type(*action->feedback->description()));
  } else if (const TypeSupport* type = find_type(options.type)) {
    print_line("{}", show_type(*type->description()));
  } else {
    std::vector<std::string> names = type_names();
    for (const auto& more : {service_names(), action_names()})
      names.insert(names.end(), more.begin(), more.end());
    throw_usage_error(
        fmt::format("'{}' is not a known type{}", options.type, did_you_mean(options.type, names)),
        "'doppel interface list' prints all of them");
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

}  // namespace

void add_interface(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "interface", "Show message, service and action types");
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
}

}  // namespace doppel::app
