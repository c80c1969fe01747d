// The hardware of a robot: which type makes each component, and what the start does where one is not there.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/devices/drivers/servo_assignment.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/devices/emulated_robot/emulated_hardware.h"
#include "doppel/devices/emulated_robot/emulated_port.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/twin/loop/control_stack.h"

namespace doppel {
namespace {

// Makes names of components and interfaces unique: repeated ones are dropped.
class Unique {
 public:
  explicit Unique(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}

  HardwareDescription of(HardwareDescription hardware) {
    const std::string name = hardware.name;
    for (int i = 2; !components_.insert(hardware.name).second; ++i)
      hardware.name = fmt::format("{}_{}", name, i);
    if (hardware.name != name) {
      diagnostics_.warning("ros2_control.duplicate_component", hardware.source,
                           fmt::format("there is another <ros2_control> '{}'; this one is renamed to '{}'",
                                       name, hardware.name),
                           "give each component its own name");
    }
    for (auto* parts : {&hardware.joints, &hardware.sensors, &hardware.gpios}) {
      for (HardwareJointDescription& part : *parts) {
        erase_known(part.command_interfaces, "command", part.name);
        erase_known(part.state_interfaces, "state", part.name);
      }
    }
    return hardware;
  }

 private:
  void erase_known(std::vector<HardwareInterfaceDescription>& interfaces, const char* kind,
                   const std::string& part) {
    std::erase_if(interfaces, [&](const HardwareInterfaceDescription& interface) {
      const std::string name = part + '/' + interface.name;
      if (interfaces_.insert(fmt::format("{} {}", kind, name)).second) return false;
      diagnostics_.warning(
          "ros2_control.duplicate_interface", interface.source,
          fmt::format("the {} interface '{}' is already exported; this one is ignored", kind, name),
          "export it once, in one <ros2_control> element");
      return true;
    });
  }

  Diagnostics& diagnostics_;
  std::set<std::string> components_, interfaces_;
};

// The description with servos of the emulation, where it has none and they are requested.
HardwareDescription with_emulated_servos(HardwareDescription hardware, const Model& model,
                                         const ControlStack::Options& options, Diagnostics& diagnostics) {
  const bool emulated = options.use == HardwareUse::emulated || options.use == HardwareUse::ports;
  if (!emulated || !options.emulation.servos) return hardware;
  const auto driver = std::ranges::find(servo_plugins(), hardware.plugin, &ServoPlugin::name);
  if (driver != servo_plugins().end() && driver->protocol != *options.emulation.servos)
    diagnostics.warning(
        "hardware.protocol_of_driver", hardware.plugin_source,
        fmt::format("'{}' is emulated as {}, of its driver {}, and not as {}", hardware.name,
                    to_string(driver->protocol), driver->name, to_string(*options.emulation.servos)),
        "--protocol is for robots without a driver of servos; change the <plugin> of this one");
  assign_servos(hardware, model, *options.emulation.servos);
  return hardware;
}

bool has_driver(const std::string& plugin) {
  return is_servo_plugin(plugin) || is_topic_plugin(plugin);
}

bool has_commands(const HardwareDescription& hardware) {
  const auto commanded = [](const HardwareJointDescription& one) { return !one.command_interfaces.empty(); };
  return std::ranges::any_of(hardware.joints, commanded) || std::ranges::any_of(hardware.gpios, commanded);
}

Diagnostic no_driver(const HardwareDescription& hardware, const HardwareRegistry& registry,
                     const std::string& argument) {
  std::vector<std::string> names = registry.names();
  for (const ServoPlugin& one : servo_plugins()) names.emplace_back(one.name);
  const std::string what =
      hardware.plugin.empty()
          ? fmt::format("<ros2_control> '{}' has no <plugin>", hardware.name)
          : fmt::format("doppel has no driver '{}'{}", hardware.plugin, did_you_mean(hardware.plugin, names));
  return {Severity::error, "hardware.no_driver", fmt::format("{} asks for hardware, and {}", argument, what),
          hardware.plugin_source, kWaysToHardware};
}

void report_nothing_driven(const CompiledRobot& machine, const std::string& argument,
                           Diagnostics& diagnostics) {
  std::vector<std::string> components;
  for (const HardwareDescription& one : machine.hardware())
    components.push_back(fmt::format("'{}' has {}", one.name, one.plugin));
  if (components.empty()) components.emplace_back("the description has no <ros2_control>");
  const SourceLocation where =
      machine.hardware().empty() ? SourceLocation{} : machine.hardware().front().plugin_source;
  diagnostics.warning("hardware.nothing_driven", where,
                      fmt::format("{}, but nothing drives hardware: {}; the robot is simulated", argument,
                                  fmt::join(components, ", ")),
                      kWaysToHardware);
}

}  // namespace

bool ControlStack::has_device(const CompiledRobot& machine, const Options& options) {
  if (options.use == HardwareUse::ports) return false;
  const bool servos = options.use == HardwareUse::emulated, topics = options.use == HardwareUse::real;
  return std::ranges::any_of(machine.hardware(), [&](const HardwareDescription& one) {
    const HardwareRegistry::Type* type = options.hardware.find(one.plugin);
    const bool emulated = servos && (options.emulation.servos || is_servo_plugin(one.plugin));
    const bool real =
        (topics && is_topic_plugin(one.plugin)) || (type != nullptr && has_wall_clock(type->kind));
    return emulated || (real && !options.rehearsal);
  });
}

HardwareRegistry ControlStack::types_for(Bus& bus, const CompiledRobot& machine, Instance instance,
                                         const Options& options) {
  // A copy for this robot: its simulated hardware is bound to the instance, and another robot has its own.
  HardwareRegistry registry = options.hardware;
  register_simulated_hardware(registry, instance);
  if (options.use == HardwareUse::emulated) register_emulated_hardware(registry, instance, options.emulation);
  if (options.use == HardwareUse::real && !options.rehearsal)
    register_topic_hardware(registry, bus, machine.name_space().empty() ? "" : "/" + machine.name_space());
  if (options.use == HardwareUse::ports) register_emulated_ports(registry, instance, options.emulation);
  return registry;
}

void ControlStack::add_hardware(Bus& bus, const CompiledRobot& machine, Instance instance,
                                const Options& options, const Log& log, Diagnostics& diagnostics) {
  const HardwareRegistry registry = types_for(bus, machine, instance, options);
  const bool is_asked = options.use == HardwareUse::real && !options.rehearsal;
  const std::string argument = is_asked ? hardware_argument(machine.asked().arguments) : "";
  Unique unique(diagnostics);
  bool driven = false;
  for (const HardwareDescription& written : machine.hardware()) {
    HardwareDescription description = with_emulated_servos(written, machine.model(), options, diagnostics);
    const HardwareRegistry::Type* type = registry.find(description.plugin);
    // A rehearsal must not open a device that the running robot uses.
    const bool rehearsed = type != nullptr && options.rehearsal && has_wall_clock(type->kind);
    const bool device = type != nullptr && type->kind != HardwareKind::simulated && !rehearsed;
    driven = driven || device;
    if (type != nullptr && type->kind == HardwareKind::emulated) {
      report_emulated(written, diagnostics);
    } else if (type == nullptr && !argument.empty() && has_commands(written)) {
      absent_.push_back(no_driver(written, registry, argument));
    } else {
      report_plugin(written,
                    device                                    ? PluginUse::real
                    : rehearsed || has_driver(written.plugin) ? PluginUse::driver
                                                              : PluginUse::simulated,
                    diagnostics);
    }
    // A plugin that is not installed here is simulated, with a note.
    if (type == nullptr || rehearsed) type = registry.find(kSimulatedPlugin);
    add_component(machine, unique.of(description), *type, device && options.must_start, log, diagnostics);
  }
  if (!argument.empty() && !driven && absent_.empty()) report_nothing_driven(machine, argument, diagnostics);
}

void ControlStack::add_component(const CompiledRobot& machine, HardwareDescription description,
                                 const HardwareRegistry::Type& type, bool must_start, const Log& log,
                                 Diagnostics& diagnostics) {
  std::unique_ptr<HardwareComponent> component = type.make();
  if (auto* simulated = dynamic_cast<SimulatedHardware*>(component.get())) {
    description.is_async = false;  // the simulation has one clock
    simulated_.push_back({simulated, description});
    use_sensors(*simulated, description, machine);
  }
  if (auto* stepped = dynamic_cast<SteppedDevice*>(component.get())) {
    description.is_async = false;
    stepped_.push_back(stepped);
  }
  // A bus has a thread of its own: the loop never waits for answers.
  if (dynamic_cast<ServoHardware*>(component.get()) != nullptr && has_wall_clock(type.kind))
    description.is_async = true;
  // The bus delivers between ticks, and a thread of its own would have no turn with it.
  if (dynamic_cast<TopicHardware*>(component.get()) != nullptr) description.is_async = false;
  real_ = real_ || has_wall_clock(type.kind);
  const HardwareComponent& added = *component;
  const Status started = manager_->add_hardware(std::move(component), description, diagnostics);
  if (!started) note_refusal(added, description, started.why(), must_start, log);
}

void ControlStack::note_refusal(const HardwareComponent& component, const HardwareDescription& description,
                                const std::string& why, bool must_start, const Log& log) {
  if (!component.awaits().empty()) {
    awaited_.push_back({&component, description.name});
  } else if (must_start) {
    absent_.push_back(
        {Severity::error, "hardware.not_started", why, description.plugin_source,
         fmt::format("to start without it, write hardware_components_initial_state: {{unconfigured: [{}]}} "
                     "for the controller manager",
                     description.name)});
  } else {
    log.error(kManager, why);
  }
}

void ControlStack::use_sensors(SimulatedHardware& hardware, const HardwareDescription& description,
                               const CompiledRobot& machine) {
  const SensorBindings bindings = bind_sensors(description, machine.model(), machine.sensors());
  for (const Diagnostic& finding : bindings.unbound.all()) unbound_.push_back({description.name, finding});
  std::vector<RigSensor> sensors;
  for (const RobotSensor& sensor : bindings.sensors) sensors.push_back(make_rig_sensor(machine, sensor));
  std::unique_ptr<SensorReadings> readings;
  if (!sensors.empty())
    readings = std::make_unique<SensorReadings>(sensors, sensor_options_, *earth_, manager_->period(),
                                                ranges_.get());
  hardware.use_sensors(bindings, std::move(readings));
}

// Also of those that an edit has given to another component.
void ControlStack::resume_sensors(const ControlStack& former) {
  for (const Simulated& one : simulated_)
    for (const Simulated& before : former.simulated_) one.hardware->resume_sensors(*before.hardware);
}

HardwareState ControlStack::state_of(const std::string& component) const {
  const std::vector<HardwareView> all = manager_->hardware();
  return std::ranges::find(all, component, &HardwareView::name)->state;
}

std::vector<std::string> ControlStack::awaited() const {
  std::vector<std::string> out;
  for (const Awaited& one : awaited_) out.push_back(one.name);
  return out;
}

// Only at the start: after a fault a person activates it.
void ControlStack::attend(const Log& log) {
  if (!waiting_ || manager_->is_stopped()) return;
  for (Awaited& one : awaited_) {
    if (one.failed || state_of(one.name) != HardwareState::inactive || !one.hardware->awaits().empty())
      continue;
    const Status active = manager_->set_hardware_state(one.name, HardwareState::active);
    one.failed = !active.ok();
    if (one.failed) log.error(kManager, active.why());
  }
  // Also those that a client has activated, or that have failed meanwhile.
  std::erase_if(awaited_,
                [this](const Awaited& one) { return state_of(one.name) != HardwareState::inactive; });
  if (!awaited_.empty()) return;
  const ControllerSelection selection = *std::exchange(waiting_, std::nullopt);
  try {
    start(selection, log);
  } catch (const InputError& problem) {
    log.error(kManager, problem.what());
  }
}

}  // namespace doppel
