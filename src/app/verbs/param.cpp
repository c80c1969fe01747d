#include <algorithm>
#include <limits>
#include <map>

#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/near_names.h"
#include "doppel/ros/bus/parameter_file.h"
#include "doppel/ros/bus/parameter_file_text.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel::app {
namespace {

struct ParamOptions {
  std::string node, name, value;
};

int list_parameters(Shell& shell, const ParamOptions& options) {
  Client& twin = shell.twin();
  const bool all = options.node.empty();
  std::map<std::string, std::vector<std::string>> by_node;
  for (const NamedParameter& parameter :
       all ? twin.parameters() : twin.parameters(find_node_name(twin, options.node))) {
    by_node[parameter.node].push_back(parameter.name);
  }
  for (auto& [node, names] : by_node) {
    if (all) print_line("{}:\n", node);
    std::ranges::sort(names);
    for (const std::string& name : names) print_line("  {}\n", name);
  }
  return 0;
}

NamedParameter find(Client& twin, const ParamOptions& options) {
  const std::string node = find_node_name(twin, options.node);
  std::vector<std::string> names;
  for (NamedParameter& parameter : twin.parameters(node)) {
    if (parameter.name == options.name) return std::move(parameter);
    names.push_back(parameter.name);
  }
  throw ClientError(
      fmt::format("node {} has no parameter '{}'{}", node, options.name, names_near(options.name, names)));
}

std::string heading(const ParameterValue& value) {
  struct Heading {
    std::string operator()(std::monostate) const { return "Parameter not set."; }
    std::string operator()(bool) const { return "Boolean value is: "; }
    std::string operator()(std::int64_t) const { return "Integer value is: "; }
    std::string operator()(double) const { return "Double value is: "; }
    std::string operator()(const std::string&) const { return "String value is: "; }
    std::string operator()(const std::vector<bool>&) const { return "Boolean values are: "; }
    std::string operator()(const std::vector<std::int64_t>&) const { return "Integer values are: "; }
    std::string operator()(const std::vector<double>&) const { return "Double values are: "; }
    std::string operator()(const std::vector<std::string>&) const { return "String values are: "; }
  };
  return std::visit(Heading(), value);
}

int get(Shell& shell, const ParamOptions& options) {
  const NamedParameter parameter = find(shell.twin(), options);
  const auto* text = std::get_if<std::string>(&parameter.value);
  const bool is_set = !std::holds_alternative<std::monostate>(parameter.value);
  print_line("{}{}\n", heading(parameter.value),
             text != nullptr ? *text
             : is_set        ? to_string(parameter.value)
                             : "");
  return 0;
}

int set(Shell& shell, const ParamOptions& options) {
  Client& twin = shell.twin();
  const NamedParameter parameter = find(twin, options);
  ParameterValue value = parse_parameter(options.value);
  if (std::holds_alternative<std::string>(parameter.value) && !std::holds_alternative<std::string>(value)) {
    value = options.value;  // a text may look like a number
  }
  const Status status = twin.set_parameter(parameter.node, parameter.name, value);
  if (!status) throw ClientError(fmt::format("setting the parameter failed: {}", status.why()));
  print_line("Set parameter successful\n");
  return 0;
}

// An open end is the largest number of the type, or infinite.
template <class Value, class Step>
void print_range(Value from, Value to, Step step) {
  constexpr Value kMaxValue = std::numeric_limits<Value>::max();
  if (from > -kMaxValue) print_line("    Min value: {}\n", from);
  if (to < kMaxValue) print_line("    Max value: {}\n", to);
  if (step != Step{}) print_line("    Step: {}\n", step);
}

// The names of types in a descriptor, as printed by ros2param.
std::string_view described_type(std::uint8_t type) {
  constexpr std::string_view kNames[] = {"not set",      "boolean",     "integer",       "double",
                                         "string",       "byte array",  "boolean array", "integer array",
                                         "double array", "string array"};
  return type < std::size(kNames) ? kNames[type] : kNames[0];
}

int describe(Shell& shell, const ParamOptions& options) {
  using rcl_interfaces::srv::DescribeParameters;
  Client& twin = shell.twin();
  const NamedParameter parameter = find(twin, options);
  const auto response =
      call<DescribeParameters>(twin, parameter.node + "/describe_parameters", {.names = {parameter.name}});
  if (response.descriptors.empty())
    throw ClientError(fmt::format("{} does not describe '{}'", parameter.node, parameter.name));
  const auto& about = response.descriptors.front();
  print_line("Parameter name: {}\n  Type: {}\n", parameter.name, described_type(about.type));
  if (!about.description.empty()) print_line("  Description: {}\n", about.description);
  print_line("  Constraints:\n");
  if (about.read_only) print_line("    Read only: true\n");
  for (const auto& range : about.floating_point_range)
    print_range(range.from_value, range.to_value, range.step);
  for (const auto& range : about.integer_range) print_range(range.from_value, range.to_value, range.step);
  if (!about.additional_constraints.empty())
    print_line("    Additional constraints: {}\n", about.additional_constraints);
  return 0;
}

int dump(Shell& shell, const ParamOptions& options) {
  Client& twin = shell.twin();
  const std::string node = find_node_name(twin, options.node);
  std::vector<std::pair<std::string, ParameterValue>> parameters;
  for (NamedParameter& parameter : twin.parameters(node))
    parameters.emplace_back(std::move(parameter.name), std::move(parameter.value));
  print_out(parameter_file_text(node, parameters));
  return 0;
}

// Loads as many as possible; rejected ones are reported and set exit code 1.
int load_parameters(Shell& shell, const ParamOptions& options) {
  const ParameterFile file = ParameterFile::load(options.value);
  Client& twin = shell.twin();
  const std::string node = find_node_name(twin, options.node);
  const ParameterOverrides overrides = file.overrides_for(node);
  if (overrides.all().empty()) {
    throw ClientError(
        fmt::format("{} has no parameters for {}{}", options.value, node, did_you_mean(node, file.nodes())));
  }
  int exit_code = 0;
  for (const ParameterOverride& parameter : overrides.all()) {
    if (const Status status = twin.set_parameter(node, parameter.name, parameter.value)) {
      print_line("Set parameter {} successful\n", parameter.name);
    } else {
      exit_code = 1;
      print_note(fmt::format("Set parameter {} failed: {}", parameter.name, status.why()));
    }
  }
  return exit_code;
}

}  // namespace

void add_param(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "param", "Read and set node parameters",
                              "doppel param list /controller_manager\n  doppel param set "
                              "/omarm_arm_controller constraints.goal_time 0.5");
  const auto node_and_name = [](CLI::App& verb, ParamOptions& options) {
    verb.add_option("node", options.node, "Node name")->required();
    verb.add_option("parameter", options.name, "Parameter name")->required();
  };
  add_verb<ParamOptions>(
      group, "list", "List parameters", "doppel param list /controller_manager", exit_code,
      [](CLI::App& verb, ParamOptions& options) {
        verb.add_option("node", options.node, "Only the parameters of this node");
      },
      list_parameters);
  add_verb<ParamOptions>(group, "get", "Print the value of a parameter",
                         "doppel param get /controller_manager update_rate", exit_code, node_and_name, get);
  add_verb<ParamOptions>(
      group, "set", "Set a parameter", "doppel param set /omarm_arm_controller constraints.goal_time 0.5",
      exit_code,
      [node_and_name](CLI::App& verb, ParamOptions& options) {
        node_and_name(verb, options);
        verb.add_option("value", options.value, "Value as YAML")->required();
      },
      set);
  add_verb<ParamOptions>(group, "describe", "Print the description and constraints of a parameter",
                         "doppel param describe /controller_manager update_rate", exit_code, node_and_name,
                         describe);
  add_verb<ParamOptions>(
      group, "dump", "Print all parameters of a node as YAML", "doppel param dump /controller_manager",
      exit_code,
      [](CLI::App& verb, ParamOptions& options) {
        verb.add_option("node", options.node, "Node name")->required();
      },
      dump);
  add_verb<ParamOptions>(
      group, "load", "Set parameters of a node from a file",
      "doppel param load /omarm_arm_controller arm.yaml", exit_code,
      [](CLI::App& verb, ParamOptions& options) {
        verb.add_option("node", options.node, "Node name")->required();
        verb.add_option("file", options.value, "ROS 2 parameter file: node, ros__parameters, values")
            ->required();
      },
      load_parameters);
}

}  // namespace doppel::app
