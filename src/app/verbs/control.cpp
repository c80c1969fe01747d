#include <algorithm>
#include <cctype>

#include "app/verbs/controllers.h"
#include "app/verbs/log_lines.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::app {

namespace msg = controller_manager_msgs::msg;
namespace srv = controller_manager_msgs::srv;

namespace {

constexpr std::string_view kListControllers = "/list_controllers";

}  // namespace

std::vector<std::string> find_managers(Client& twin) {
  std::vector<std::string> managers;
  for (const auto& [name, service] : twin.services()) {
    const bool only_wanted = service.providers.empty() && !service.clients.empty();
    if (service.type == service_support<srv::ListControllers>().name && name.ends_with(kListControllers) &&
        !only_wanted && name.starts_with(robot_namespace() + "/"))
      managers.push_back(name.substr(0, name.size() - kListControllers.size()));
  }
  return managers;
}

std::string find_manager(Client& twin, const std::string& asked) {
  if (!asked.empty()) return absolute(asked);
  const std::vector<std::string> managers = find_managers(twin);
  if (managers.size() > 1)
    throw_usage_error(
        fmt::format("there are {} controller managers: {}", managers.size(), fmt::join(managers, ", ")),
        fmt::format("choose one with --ns ROBOT or --controller-manager {}", managers.front()));
  return managers.empty() ? absolute("controller_manager") : managers.front();
}

void declare_manager(CLI::App& verb, std::string& manager) {
  verb.add_option("-c,--controller-manager", manager, "Controller manager node name (default: the only one)");
}

bool is_stopped(Client& twin, const std::string& manager) {
  const std::string topic = manager + "/emergency_stop_active";
  const auto found = twin.topics().find(topic);
  if (found == twin.topics().end() || found->second.publishers.empty()) return false;
  twin.subscribe(topic);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  Client::Received message;
  while (twin.next(message, until)) {
    if (message.topic == topic) return decode<std_msgs::msg::Bool>(message.cdr).data;
  }
  return false;
}

const std::vector<std::string>& command_interfaces_of(const msg::ControllerState& controller) {
  return controller.claimed_interfaces.empty() ? controller.required_command_interfaces
                                               : controller.claimed_interfaces;
}

std::vector<std::string> joints_of(const msg::ControllerState& controller) {
  std::vector<std::string> joints;
  for (const std::string& interface : command_interfaces_of(controller)) {
    std::string joint = interface.substr(0, interface.rfind('/'));
    if (std::ranges::find(joints, joint) == joints.end()) joints.push_back(std::move(joint));
  }
  return joints;
}

std::vector<msg::ControllerState> list_controllers(Client& twin, const std::string& manager) {
  return call<srv::ListControllers>(twin, manager + std::string(kListControllers)).controller;
}

namespace {

struct ControlOptions {
  std::string manager;  // as requested; when a verb runs, the complete name
  bool verbose = false, claimed = false, required_states = false, required_commands = false;
  std::string name, type, state;
  std::vector<std::string> activate, deactivate;
  bool strict = false, best_effort = false, as_soon_as_possible = false;
};

std::string service(const ControlOptions& options, std::string_view name) {
  return fmt::format("{}/{}", options.manager, name);
}

void print_list(const char* heading, const std::vector<std::string>& names) {
  print_line("\t{}:\n", heading);
  for (const std::string& name : names) print_line("\t\t{}\n", name);
}

int controllers(Shell& shell, const ControlOptions& options) {
  const auto all = list_controllers(shell.twin(), options.manager);
  if (all.empty()) print_note("No controllers are currently loaded!");
  std::size_t name_width = 0, type_width = 0;
  for (const auto& c : all) {
    name_width = std::max(name_width, c.name.size());
    type_width = std::max(type_width, c.type.size());
  }
  for (const auto& c : all) {
    print_line("{:<{}} {:<{}}  {}\n", c.name, name_width, c.type, type_width, c.state);
    if (options.verbose) print_line("\tupdate_rate: {} Hz\n", c.update_rate);
    if (options.verbose || options.claimed) print_list("claimed interfaces", c.claimed_interfaces);
    if (options.verbose || options.required_commands)
      print_list("required command interfaces", c.required_command_interfaces);
    if (options.verbose || options.required_states)
      print_list("required state interfaces", c.required_state_interfaces);
  }
  return 0;
}

int controller_types(Shell& shell, const ControlOptions& options) {
  const auto all = call<srv::ListControllerTypes>(shell.twin(), service(options, "list_controller_types"));
  for (std::size_t i = 0; i < all.types.size(); ++i) {
    print_line("{:<70} {}\n", all.types[i], i < all.base_classes.size() ? all.base_classes[i] : "");
  }
  return 0;
}

std::string availability(const msg::HardwareInterface& interface) {
  return fmt::format("[{}] [{}]", interface.is_available ? "available" : "unavailable",
                     interface.is_claimed ? "claimed" : "unclaimed");
}

int hardware_interfaces(Shell& shell, const ControlOptions& options) {
  const auto all =
      call<srv::ListHardwareInterfaces>(shell.twin(), service(options, "list_hardware_interfaces"));
  print_line("command interfaces\n");
  for (const auto& interface : all.command_interfaces)
    print_line("\t{} {}\n", interface.name, availability(interface));
  print_line("state interfaces\n");
  for (const auto& interface : all.state_interfaces) print_line("\t{}\n", interface.name);
  return 0;
}

// Why a component is not active, as its own node reports; "" where nothing has failed.
std::string fault_of(const std::vector<NamedParameter>& parameters, const ControlOptions& options,
                     std::string component) {
  for (char& c : component) {
    const auto byte = static_cast<unsigned char>(c);
    c = std::isalnum(byte) != 0 ? static_cast<char>(std::tolower(byte)) : '_';
  }
  const std::string node = options.manager.substr(0, options.manager.rfind('/') + 1) + component;
  for (const NamedParameter& parameter : parameters) {
    const auto* fault = std::get_if<std::string>(&parameter.value);
    if (parameter.node == node && parameter.name == "fault" && fault != nullptr) return *fault;
  }
  return "";
}

int hardware_components(Shell& shell, const ControlOptions& options) {
  const auto all =
      call<srv::ListHardwareComponents>(shell.twin(), service(options, "list_hardware_components"));
  const bool failed = std::ranges::any_of(all.component, [](const auto& c) {
    return c.state.id != lifecycle_msgs::msg::State::PRIMARY_STATE_ACTIVE;
  });
  const auto parameters = failed ? shell.twin().parameters() : std::vector<NamedParameter>{};
  int number = 0;
  for (const auto& c : all.component) {
    print_line("Hardware Component {}\n\tname: {}\n\ttype: {}\n\tplugin name: {}\n\tstate: id={} label={}\n",
               ++number, c.name, c.type, c.plugin_name, c.state.id, c.state.label);
    if (const std::string fault = fault_of(parameters, options, c.name); !fault.empty())
      print_line("\tfault: {}\n", fault);
    print_line("\tread/write rate: {} Hz\n\tis_async: {}\n\tcommand interfaces\n", c.rw_rate, c.is_async);
    for (const auto& interface : c.command_interfaces)
      print_line("\t\t{} {}\n", interface.name, availability(interface));
    if (!options.verbose) continue;
    print_line("\tstate interfaces\n");
    for (const auto& interface : c.state_interfaces) print_line("\t\t{} [available]\n", interface.name);
  }
  return 0;
}

// The state of a controller; "" if it is not loaded.
std::string state_of(Client& twin, const ControlOptions& options, const std::string& name) {
  const auto all = list_controllers(twin, options.manager);
  const auto found = std::ranges::find(all, name, &msg::ControllerState::name);
  return found == all.end() ? "" : found->state;
}

// The manager's log line about what it has refused, or `what` with the place of the reason.
std::string reason_or(LogLines& lines, const ControlOptions& options, const std::string& what) {
  const std::string line = lines.last_problem(options.manager);
  return line.empty() ? what + kReasonElsewhere : line;
}

// Suggestions: the loaded controllers, and those that the controllers' YAML declares.
[[noreturn]] void cannot_load(Client& twin, LogLines& lines, const ControlOptions& options) {
  std::vector<std::string> names;
  for (const auto& c : list_controllers(twin, options.manager)) names.push_back(c.name);
  for (const NamedParameter& parameter : twin.parameters(options.manager)) {
    if (!parameter.name.ends_with(".type")) continue;
    names.push_back(parameter.name.substr(0, parameter.name.rfind('.')));
  }
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  throw ClientError(
      std::ranges::find(names, options.name) == names.end()
          ? fmt::format("no controller '{}' is declared{}", options.name, did_you_mean(options.name, names))
          : reason_or(lines, options, fmt::format("cannot load {}", options.name)));
}

[[noreturn]] void not_loaded(Client& twin, const ControlOptions& options, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& c : list_controllers(twin, options.manager)) names.push_back(c.name);
  throw ClientError(fmt::format("no controller '{}' is loaded{}", name, did_you_mean(name, names)));
}

void switch_to(Client& twin, const ControlOptions& options, const std::vector<std::string>& activate,
               const std::vector<std::string>& deactivate, std::int32_t strictness) {
  srv::SwitchController::Request request;
  request.activate_controllers = activate;
  request.deactivate_controllers = deactivate;
  request.strictness = strictness;
  request.activate_asap = options.as_soon_as_possible;
  const auto response = call<srv::SwitchController>(twin, service(options, "switch_controller"), request);
  if (!response.ok) {
    throw ClientError(response.message.empty() ? "cannot switch the controllers" : response.message);
  }
}

// Along unconfigured, inactive, active, or back.
void bring_to_state(Client& twin, const ControlOptions& options, const std::string& name, std::string state,
                    const std::string& wanted) {
  constexpr auto kStrict = srv::SwitchController::Request::STRICT;
  if (state == "unconfigured" && wanted != "unconfigured") {
    LogLines lines(twin);
    if (!call<srv::ConfigureController>(twin, service(options, "configure_controller"), {name}).ok)
      throw ClientError(reason_or(lines, options, fmt::format("cannot configure {}", name)));
    state = "inactive";
  }
  if (state == "inactive" && wanted == "active") {
    switch_to(twin, options, {name}, {}, kStrict);
  } else if (state == "active" && wanted == "inactive") {
    switch_to(twin, options, {}, {name}, kStrict);
  } else if (state != wanted) {
    throw ClientError(fmt::format("{} cannot go from {} to {}", name, state, wanted));
  }
}

int load_controllers(Shell& shell, const ControlOptions& options) {
  Client& twin = shell.twin();
  const std::string before = state_of(twin, options, options.name);
  if (!before.empty() && (before == options.state || options.state.empty())) {
    print_line("{} is already loaded and {}\n", options.name, before);
    return 0;
  }
  if (before.empty()) {
    if (!options.type.empty()) {
      const Status status = twin.set_parameter(options.manager, options.name + ".type", options.type);
      if (!status) throw ClientError(status.why());
    }
    LogLines lines(twin);
    if (!call<srv::LoadController>(twin, service(options, "load_controller"), {options.name}).ok)
      cannot_load(twin, lines, options);
  }
  if (options.state.empty()) {
    print_line("Successfully loaded controller {}\n", options.name);
    return 0;
  }
  bring_to_state(twin, options, options.name, before.empty() ? "unconfigured" : before, options.state);
  print_line("Successfully loaded controller {} into state {}\n", options.name, options.state);
  return 0;
}

int set_state(Shell& shell, const ControlOptions& options) {
  Client& twin = shell.twin();
  const std::string before = state_of(twin, options, options.name);
  if (before.empty()) not_loaded(twin, options, options.name);
  if (before == options.state) {
    print_line("{} is already {}\n", options.name, before);
    return 0;
  }
  bring_to_state(twin, options, options.name, before, options.state);
  print_line("Successfully set {} to {}\n", options.name, options.state);
  return 0;
}

int switch_controllers(Shell& shell, const ControlOptions& options) {
  using Request = srv::SwitchController::Request;
  if (options.activate.empty() && options.deactivate.empty()) {
    throw_usage_error("there are no controllers to switch",
                      "list controllers after --activate or --deactivate");
  }
  if (options.strict && options.best_effort)
    throw_usage_error("--strict and --best-effort are mutually exclusive");
  Client& twin = shell.twin();
  for (const auto* names : {&options.activate, &options.deactivate}) {
    for (const std::string& name : *names) {
      if (options.strict && state_of(twin, options, name).empty()) not_loaded(twin, options, name);
    }
  }
  switch_to(twin, options, options.activate, options.deactivate,
            options.strict ? Request::STRICT : Request::BEST_EFFORT);
  print_line("Successfully switched controllers\n");
  return 0;
}

// Refused: the component's own reason, which its node reports and the log has.
int set_component_state(Shell& shell, const ControlOptions& options) {
  using lifecycle_msgs::msg::State;
  constexpr std::pair<const char*, std::uint8_t> kStates[] = {
      {"unconfigured", State::PRIMARY_STATE_UNCONFIGURED},
      {"inactive", State::PRIMARY_STATE_INACTIVE},
      {"active", State::PRIMARY_STATE_ACTIVE}};
  Client& twin = shell.twin();
  std::vector<std::string> names;
  for (const auto& one :
       call<srv::ListHardwareComponents>(twin, service(options, "list_hardware_components")).component)
    names.push_back(one.name);
  if (std::ranges::find(names, options.name) == names.end())
    throw ClientError(
        fmt::format("no hardware component '{}'{}", options.name, did_you_mean(options.name, names)));
  srv::SetHardwareComponentState::Request request;
  request.name = options.name;
  request.target_state.label = options.state;
  for (const auto& [label, id] : kStates) {
    if (options.state == label) request.target_state.id = id;
  }
  LogLines lines(twin);
  const auto response =
      call<srv::SetHardwareComponentState>(twin, service(options, "set_hardware_component_state"), request);
  if (!response.ok)
    throw ClientError(
        reason_or(lines, options, fmt::format("{} stays {}", options.name, response.state.label)));
  print_line("Successfully set {} to {}\n", options.name, response.state.label);
  return 0;
}

int unload(Shell& shell, const ControlOptions& options) {
  Client& twin = shell.twin();
  if (state_of(twin, options, options.name).empty()) not_loaded(twin, options, options.name);
  if (!call<srv::UnloadController>(twin, service(options, "unload_controller"), {options.name}).ok) {
    throw ClientError(fmt::format("cannot unload {}; is it still active?", options.name));
  }
  print_line("Successfully unloaded controller {}\n", options.name);
  return 0;
}

// The verb with the manager found.
auto with_manager(int (*run)(Shell&, const ControlOptions&)) {
  return [run](Shell& shell, const ControlOptions& asked) {
    ControlOptions options = asked;
    options.manager = find_manager(shell.twin(), asked.manager);
    return run(shell, options);
  };
}

void declare_only_manager(CLI::App& verb, ControlOptions& options) {
  declare_manager(verb, options.manager);
}

void declare_listing(CLI::App& verb, ControlOptions& options) {
  declare_manager(verb, options.manager);
  verb.add_flag("-v,--verbose", options.verbose, "Show their interfaces");
}

void declare_controller(CLI::App& verb, ControlOptions& options) {
  declare_manager(verb, options.manager);
  verb.add_option("controller", options.name, "Controller name")->required();
}

void add_changes(CLI::App& group, int& exit_code) {
  add_verb<ControlOptions>(
      group, "load_controller", "Load a controller and set its state",
      "doppel control load_controller --set-state active joint_state_broadcaster", exit_code,
      [](CLI::App& verb, ControlOptions& options) {
        declare_controller(verb, options);
        verb.add_option("type", options.type, "Controller type, if the parameter file does not declare it");
        verb.add_option("--set-state", options.state, "Target state: inactive or active")
            ->check(CLI::IsMember({"inactive", "active"}));
      },
      with_manager(load_controllers));
  add_verb<ControlOptions>(
      group, "set_controller_state", "Activate or deactivate a controller",
      "doppel control set_controller_state omarm_arm_controller inactive", exit_code,
      [](CLI::App& verb, ControlOptions& options) {
        declare_controller(verb, options);
        verb.add_option("state", options.state, "Target state: inactive or active")
            ->required()
            ->check(CLI::IsMember({"inactive", "active"}));
      },
      with_manager(set_state));
  add_verb<ControlOptions>(
      group, "switch_controllers", "Activate and deactivate controllers in one switch",
      "doppel control switch_controllers --activate pid --deactivate omarm_arm_controller --strict",
      exit_code,
      [](CLI::App& verb, ControlOptions& options) {
        declare_manager(verb, options.manager);
        verb.add_option("--activate,--start", options.activate, "Controllers to activate");
        verb.add_option("--deactivate,--stop", options.deactivate, "Controllers to deactivate");
        verb.add_flag("--strict", options.strict, "Switch all controllers or none");
        verb.add_flag("--best-effort", options.best_effort,
                      "Switch the controllers that can be switched (default)");
        verb.add_flag("--activate-asap,--start-asap", options.as_soon_as_possible,
                      "Activate as soon as the hardware is ready");
      },
      with_manager(switch_controllers));
  add_verb<ControlOptions>(
      group, "set_hardware_component_state", "Configure, activate or deactivate a hardware component",
      "doppel control set_hardware_component_state Arm active    # after a fault", exit_code,
      [](CLI::App& verb, ControlOptions& options) {
        declare_manager(verb, options.manager);
        verb.add_option("component", options.name, "Name of the <ros2_control> block")->required();
        verb.add_option("state", options.state, "Target state: unconfigured, inactive or active")
            ->required()
            ->check(CLI::IsMember({"unconfigured", "inactive", "active"}));
      },
      with_manager(set_component_state));
  add_verb<ControlOptions>(group, "unload_controller", "Unload an inactive controller",
                           "doppel control unload_controller pid", exit_code, declare_controller,
                           with_manager(unload));
}

}  // namespace

void add_control(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "control", "Query and switch controllers and hardware",
                              "doppel control list_controllers\n  doppel control set_controller_state "
                              "omarm_arm_controller inactive\n  doppel control list_hardware_interfaces");
  add_verb<ControlOptions>(
      group, "list_controllers", "List loaded controllers and their states",
      "doppel control list_controllers -v\n  doppel control list_controllers --claimed-interfaces", exit_code,
      [](CLI::App& verb, ControlOptions& options) {
        declare_listing(verb, options);
        verb.add_flag("--claimed-interfaces", options.claimed, "Show the claimed interfaces");
        verb.add_flag("--required-state-interfaces", options.required_states,
                      "Show the required state interfaces");
        verb.add_flag("--required-command-interfaces", options.required_commands,
                      "Show the required command interfaces");
      },
      with_manager(controllers));
  add_verb<ControlOptions>(group, "list_controller_types", "List the controller types that can be loaded",
                           "doppel control list_controller_types", exit_code, declare_only_manager,
                           with_manager(controller_types));
  add_verb<ControlOptions>(group, "list_hardware_interfaces", "List command and state interfaces",
                           "doppel control list_hardware_interfaces", exit_code, declare_only_manager,
                           with_manager(hardware_interfaces));
  add_verb<ControlOptions>(group, "list_hardware_components", "List hardware components and their states",
                           "doppel control list_hardware_components -v", exit_code, declare_listing,
                           with_manager(hardware_components));
  add_controller_chains(group, exit_code);
  add_changes(group, exit_code);
}

}  // namespace doppel::app
