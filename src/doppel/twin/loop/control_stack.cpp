#include "doppel/twin/loop/control_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "doppel/base/yaml/yaml_text.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/control/manager/rates.h"
#include "doppel/devices/drivers/servo_assignment.h"
#include "doppel/devices/emulated_robot/emulated_hardware.h"
#include "doppel/devices/emulated_robot/emulated_port.h"
#include "doppel/twin/loop/detail/state_hash.h"

namespace doppel {
namespace {

constexpr const char* kManager = "controller_manager";
constexpr const char* kBroadcaster = "joint_state_broadcaster/JointStateBroadcaster";
constexpr const char* kTrajectories = "joint_trajectory_controller/JointTrajectoryController";
constexpr const char* kVelocities = "velocity_controllers/JointGroupVelocityController";

bool is_loaded(const ControllerManager& manager, const std::string& name) {
  const auto loaded = manager.controllers();
  return std::any_of(loaded.begin(), loaded.end(), [&](const ControllerView& c) { return c.name == name; });
}

bool is_taken(const ControllerManager& manager, const std::string& name) {
  const auto declared = manager.declared_controllers();
  return is_loaded(manager, name) ||
         std::any_of(declared.begin(), declared.end(), [&](const auto& d) { return d.first == name; });
}

// `name`, or with "_rest" appended if that name exists.
std::string free_name(const ControllerManager& manager, std::string name) {
  while (is_taken(manager, name)) name += "_rest";
  return name;
}

// The joints by what the hardware's interfaces permit.
struct Offer {
  std::set<std::string> commands;               // with commands of any kind
  std::set<std::string> driven;                 // with a command that an active controller has claimed
  std::set<std::string> positions, velocities;  // with position commands and states; with velocity states
  std::set<std::string> speeds;                 // with velocity commands
};

Offer offer_of(const ControllerManager& manager) {
  Offer out;
  std::set<std::string> reported;
  const auto split = [](const std::string& full_name) {
    const std::size_t slash = full_name.find_last_of('/');
    return std::pair(full_name.substr(0, slash), full_name.substr(slash + 1));
  };
  for (const InterfaceView& state : manager.state_interfaces()) {
    const auto [joint, quantity] = split(state.full_name);
    if (quantity == kPosition) reported.insert(joint);
    if (quantity == kVelocity) out.velocities.insert(joint);
  }
  for (const InterfaceView& command : manager.command_interfaces()) {
    const auto [joint, quantity] = split(command.full_name);
    if (command.available) out.commands.insert(joint);
    if (!command.claimed_by.empty()) out.driven.insert(joint);
    if (command.available && quantity == kPosition && reported.contains(joint)) out.positions.insert(joint);
    if (command.available && quantity == kVelocity) out.speeds.insert(joint);
  }
  return out;
}

// Makes names of components and interfaces unique: repeated ones are left out.
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

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string quoted_names(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += fmt::format("{}'{}'", out.empty() ? "" : ", ", name);
  return out;
}

// True: a component of the machine will not be simulated.
// The description with servos of the emulation, where it has none and they are requested.
HardwareDescription with_emulated_servos(HardwareDescription hardware, const Model& model,
                                         const ControlStack::Options& options) {
  const bool emulated = options.use == HardwareUse::emulated || options.use == HardwareUse::ports;
  if (emulated && options.emulation.servos) assign_servos(hardware, model, *options.emulation.servos);
  return hardware;
}

bool has_device(const CompiledRobot& machine, const ControlStack::Options& options) {
  if (options.rehearsal || options.use == HardwareUse::ports) return false;
  const bool servos = options.use == HardwareUse::emulated, topics = options.use == HardwareUse::real;
  return std::ranges::any_of(machine.hardware(), [&](const HardwareDescription& one) {
    const HardwareRegistry::Type* type = options.hardware.find(one.plugin);
    const bool emulated = servos && (options.emulation.servos || is_servo_plugin(one.plugin));
    return emulated || (topics && is_topic_plugin(one.plugin)) ||
           (type != nullptr && has_wall_clock(type->kind));
  });
}

}  // namespace

Duration period_in_steps(double rate, Duration step, const SourceLocation& where, Diagnostics& diagnostics) {
  const int steps = steps_per_period(rate, step);
  const Duration period = step * steps;
  if (differs(rate, rate_of(period))) {
    const std::optional<Duration> suggested_step = step_for_rates(std::array{rate}, step);
    diagnostics.warning(
        "control.rate_rounded", where,
        fmt::format("{:g} Hz does not divide the physics rate of {:g} Hz; the controller "
                    "manager runs every {} step{}, at {:g} Hz",
                    rate, rate_of(step), steps, steps == 1 ? "" : "s", rate_of(period)),
        suggested_step
            ? fmt::format("write `step: {:.9f}` in the world file, or choose a rate that divides "
                          "{:g}",
                          to_seconds(*suggested_step), rate_of(step))
            : fmt::format("choose a rate that divides {:g}, or another physics step", rate_of(step)));
  }
  return period;
}

ControlStack::ControlStack(Bus& bus, const CompiledRobot& machine, Instance instance, const Options& options,
                           const Log& log, Diagnostics& diagnostics)
    : model_(machine.shared_model()),
      first_model_(model_),
      controllers_(machine.setup().controllers),
      named_(machine.setup().controllers_named),
      free_joints_(machine.setup().free_joints),
      spare_base_(machine.setup().spare_base),
      sensor_options_(options.sensors),
      earth_(options.earth),
      ranges_(options.ranges) {
  ControllerManagerOptions of_manager;
  if (!machine.name_space().empty()) of_manager.name_space = "/" + machine.name_space();
  of_manager.choose_period = [step = instance.engine().world().settings().step](
                                 double rate, const SourceLocation& where, Diagnostics& findings) {
    return period_in_steps(rate, step, where, findings);
  };
  of_manager.enforce_limits = options.enforce_limits;
  if ((options.guard || options.rehearses) && has_device(machine, options)) {
    guard_ = std::make_unique<CollisionGuard>(instance, options.keep_out, log);
    if (!options.guard) guard_->permit_all();
    if (options.rehearses) guard_->use_rehearsals(options.present_q, options.use == HardwareUse::real);
  }
  of_manager.guard = guard_.get();
  manager_ = std::make_unique<ControllerManager>(bus, *model_, options.controllers, &controllers_, of_manager,
                                                 log, diagnostics);
  manager_->set_soft_limits(soft_limits_of(machine.description(), *model_, diagnostics));
  add_hardware(bus, machine, instance, options, diagnostics);
  diagnostics.throw_if_errors();
  if (options.former != nullptr) resume_sensors(*options.former);
}

void ControlStack::add_hardware(Bus& bus, const CompiledRobot& machine, Instance instance,
                                const Options& options, Diagnostics& diagnostics) {
  // A copy for this robot: its simulated hardware is bound to the instance, and another robot has its own.
  HardwareRegistry registry = options.hardware;
  register_simulated_hardware(registry, instance);
  if (options.use == HardwareUse::emulated) register_emulated_hardware(registry, instance, options.emulation);
  if (options.use == HardwareUse::real && !options.rehearsal)
    register_topic_hardware(registry, bus, machine.name_space().empty() ? "" : "/" + machine.name_space());
  if (options.use == HardwareUse::ports) register_emulated_ports(registry, instance, options.emulation);
  Unique unique(diagnostics);
  for (const HardwareDescription& written : machine.hardware()) {
    HardwareDescription description = with_emulated_servos(written, machine.model(), options);
    const HardwareRegistry::Type* type = registry.find(description.plugin);
    const bool device = type != nullptr && type->kind != HardwareKind::simulated;
    if (type != nullptr && type->kind == HardwareKind::emulated) {
      report_emulated(written, diagnostics);
    } else {
      report_plugin(written, device, diagnostics);
    }
    // A plugin that is not installed here is simulated, with a note; a rehearsal of an edit must not open a
    // device that the running robot uses.
    if (type == nullptr || (device && options.rehearsal)) type = registry.find(kSimulatedPlugin);
    description = unique.of(description);
    std::unique_ptr<HardwareComponent> component = type->make();
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
    if (dynamic_cast<ServoHardware*>(component.get()) != nullptr && has_wall_clock(type->kind))
      description.is_async = true;
    // The bus delivers between ticks, and a thread of its own would have no turn with it.
    auto* const topics = dynamic_cast<TopicHardware*>(component.get());
    if (topics != nullptr) description.is_async = false;
    real_ = real_ || has_wall_clock(type->kind);
    manager_->add_hardware(std::move(component), description, diagnostics);
    if (topics != nullptr && topics->was_refused()) awaited_.push_back({topics, description.name});
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

void ControlStack::start(const ControllerSelection& selection, const Log& log) {
  if (!awaited_.empty()) {
    waiting_ = selection;
    for (const Awaited& one : awaited_)
      log.note(kManager, fmt::format("hardware '{}' and the controllers start with the first states on '{}'",
                                     one.name, one.hardware->setup().states));
    return;
  }
  only_compatible_ = selection.only_compatible;
  if (selection.only_compatible) {
    manager_->start_compatible(selection.active);
    for (const std::string& name : selection.active) {
      if (!is_loaded(*manager_, name)) left_out_.push_back(name);
    }
  } else {
    manager_->start(selection.active);
  }
  for (const std::string& name : selection.inactive) {
    if (is_loaded(*manager_, name)) continue;
    try {
      manager_->load(name);
    } catch (const InputError& problem) {
      if (!selection.only_compatible) throw;
      log.warning(name, problem.what());
      continue;
    }
    if (const Status configured = manager_->configure(name); !configured) log.warning(name, configured.why());
  }
  if (selection.only_compatible) hold_unclaimed_joints(selection, log);
  if (selection.stopped) manager_->stop("the model before the edit");
}

// Only at the start: after a fault a person activates it.
void ControlStack::attend(const Log& log) {
  if (!waiting_ || manager_->is_stopped()) return;
  std::erase_if(awaited_, [this](const Awaited& one) {
    if (one.hardware->state() != DriverState::connected) return true;  // a client has changed it
    return one.hardware->readiness().ok() &&
           manager_->set_hardware_state(one.name, HardwareState::active).ok();
  });
  if (!awaited_.empty()) return;
  const ControllerSelection selection = *std::exchange(waiting_, std::nullopt);
  try {
    start(selection, log);
  } catch (const InputError& problem) {
    log.error(kManager, problem.what());
  }
}

bool ControlStack::make(const GeneratedController& controller, bool active, const Log& log) {
  const std::string& name = controller.name;
  const std::string origin = "<generated controllers>";
  if (!controller.joints.empty()) controllers_.add(name, "joints", controller.joints, origin);
  for (const auto& [parameter, value] : controller.parameters)
    controllers_.add(name, parameter, value, origin);
  const std::vector<std::string> names{name};
  try {
    manager_->load(name, controller.type);
    generated_.push_back(controller);
    Status status = manager_->configure(name);
    if (status && active) status = manager_->switch_controllers(names, {}, Strictness::strict);
    if (status) return true;
    log.warning(kManager, fmt::format("the generated controller '{}' cannot start: {}", name, status.why()));
    static_cast<void>(manager_->unload(name));
  } catch (const InputError& problem) {
    log.warning(kManager,
                fmt::format("the generated controller '{}' cannot start: {}", name, problem.what()));
  }
  return false;
}

void ControlStack::make_idle(GeneratedController idle, const Log& log) {
  const bool commands = !idle.joints.empty();
  const Offer offer = offer_of(*manager_);
  const std::set<std::string>& there = idle.type == kVelocities ? offer.speeds : offer.positions;
  std::erase_if(idle.joints, [&](const std::string& joint) { return !there.contains(joint); });
  if (is_taken(*manager_, idle.name) || (commands && idle.joints.empty())) return;
  make(idle, false, log);
}

void ControlStack::hold_unclaimed_joints(const ControllerSelection& selection, const Log& log) {
  for (const GeneratedController& idle : selection.idle) make_idle(idle, log);
  const auto running = manager_->controllers();
  const bool seen = std::any_of(running.begin(), running.end(),
                                [](const ControllerView& c) { return c.type == kBroadcaster; });
  if (!seen && !manager_->state_interfaces().empty())
    make({free_name(*manager_, "joint_state_broadcaster"), kBroadcaster, {}, {}}, true, log);
  start_spare_base(selection, log);

  const Offer offer = offer_of(*manager_);
  // Each joint without a controller gets the strongest hold that its interfaces permit: its position, else
  // velocity zero, else it moves freely.
  std::vector<std::string> held, stopped, passive;
  bool velocities = true;
  for (const ModelJoint& joint : model_->joints) {
    if (!joint.scalar() || joint.mimics() || !offer.commands.contains(joint.name) ||
        offer.driven.contains(joint.name) || among(selection.released, joint.name) ||
        among(free_joints_, joint.name))
      continue;
    const bool position = offer.positions.contains(joint.name);
    (position ? held : offer.speeds.contains(joint.name) ? stopped : passive).push_back(joint.name);
    velocities = velocities && (!position || offer.velocities.contains(joint.name));
  }
  hold({"joint_trajectory_controller",
        kTrajectories,
        held,
        {{"command_interfaces", {kPosition}},
         {"state_interfaces", velocities ? std::vector<std::string>{kPosition, kVelocity}
                                         : std::vector<std::string>{kPosition}}}},
       log);
  hold({"velocity_controller", kVelocities, stopped, {}}, log);
  if (!passive.empty()) {
    log_diagnostic(
        log, kManager,
        {Severity::note, "up.joints_passive",
         fmt::format("no controller commands {}, which take{} effort commands only: passive; {} freely",
                     quoted_names(passive), passive.size() == 1 ? "s" : "",
                     passive.size() == 1 ? "it moves" : "they move"),
         make_location(controllers_.name()), "start a controller for their effort"});
  }
}

// Starts the spare base controller if no controller that was found commands the wheels.
void ControlStack::start_spare_base(const ControllerSelection& selection, const Log& log) {
  if (!spare_base_ || is_loaded(*manager_, spare_base_->name)) return;
  const Offer offer = offer_of(*manager_);
  const auto is_free = [&](const std::string& joint) {
    return offer.commands.contains(joint) && !offer.driven.contains(joint) &&
           !among(selection.released, joint);
  };
  // Half of a base is worse than none: all of its wheels must be free.
  if (!std::ranges::all_of(spare_base_->joints, is_free)) return;
  manager_->start_compatible(std::vector<std::string>{spare_base_->name});
  if (!is_loaded(*manager_, spare_base_->name)) return;
  free_joints_ = spare_base_->free_joints;
  log_diagnostic(
      log, kManager,
      {Severity::note, "up.base_generated", spare_base_->text, make_location(controllers_.name()),
       "declare a controller of the base in that file, or give another one with --controllers FILE"});
}

// Starts a generated controller for joints without another one, so that the robot holds its pose and
// can be commanded.
void ControlStack::hold(GeneratedController wanted, const Log& log) {
  if (wanted.joints.empty()) return;
  wanted.name = free_name(*manager_, wanted.name);
  if (!make(wanted, true, log)) return;
  log_diagnostic(
      log, kManager,
      {Severity::note, "up.joints_held",
       fmt::format("no loaded controller commands {}; '{}' was created to hold {}",
                   quoted_names(wanted.joints), wanted.name, wanted.joints.size() == 1 ? "it" : "them"),
       make_location(controllers_.name()),
       "add them to a controller, or give another file with --controllers FILE"});
}

std::string ControlStack::generated_yaml() const {
  if (generated_.empty()) return "";
  std::string declarations = "controller_manager:\n  ros__parameters:\n", sections;
  const auto list = [](const std::vector<std::string>& values) {
    std::string out;
    for (const std::string& value : values) out += (out.empty() ? "" : ", ") + yaml_text(value);
    return "[" + out + "]";
  };
  for (const GeneratedController& one : generated_) {
    declarations += fmt::format("    {}:\n      type: {}\n", one.name, one.type);
    if (one.joints.empty()) continue;
    sections += fmt::format("{}:\n  ros__parameters:\n    joints: {}\n", one.name, list(one.joints));
    for (const auto& [parameter, values] : one.parameters)
      sections += fmt::format("    {}: {}\n", parameter, list(values));
  }
  return declarations + sections;
}

ControllerSelection ControlStack::selection_of(const CompiledRobot& machine) const {
  ControllerSelection selection;
  if (machine.choices()) {
    selection.active = machine.choices()->active;
    selection.inactive = machine.choices()->inactive;
    return selection;
  }
  const std::vector<std::string>& activate = machine.asked().activate;
  selection.active = activate;
  selection.only_compatible = machine.asked().tolerant || (activate.empty() && !named_);
  for (const auto& [name, type] : manager_->declared_controllers()) {
    if (spare_base_ && name == spare_base_->name && !among(activate, name)) continue;
    if (activate.empty()) {
      selection.active.push_back(name);
    } else if (std::find(activate.begin(), activate.end(), name) == activate.end()) {
      selection.inactive.push_back(name);
    }
  }
  return selection;
}

ControllerSelection ControlStack::present_selection() const {
  if (waiting_) return *waiting_;
  ControllerSelection selection;
  selection.only_compatible = only_compatible_;
  selection.stopped = manager_->is_stopped();
  for (const ControllerView& controller : manager_->controllers()) {
    const bool active = controller.state == ControllerState::active ||
                        among(manager_->stopped_controllers(), controller.name);
    const auto made = std::find_if(generated_.begin(), generated_.end(),
                                   [&](const GeneratedController& g) { return g.name == controller.name; });
    if (made == generated_.end()) {
      (active ? selection.active : selection.inactive).push_back(controller.name);
    } else if (!active) {
      selection.idle.push_back(*made);
    }
  }
  for (const auto& [name, type] : manager_->declared_controllers()) {
    const bool spare = spare_base_ && name == spare_base_->name && !is_loaded(*manager_, name);
    if (!spare && !among(left_out_, name)) selection.declared.push_back(name);
  }
  const Offer offer = offer_of(*manager_);
  for (const std::set<std::string>* joints : {&offer.positions, &offer.speeds}) {
    for (const std::string& joint : *joints) {
      if (!offer.driven.contains(joint) && !among(selection.released, joint))
        selection.released.push_back(joint);
    }
  }
  return selection;
}

void ControlStack::take_over(const CompiledRobot& machine, Instance now) {
  // Controllers keep running over an edit; only the model that they read is exchanged, before the former
  // one is freed.
  manager_->model_changed(machine.model());
  Diagnostics reported_before;  // when the machine was prepared
  manager_->set_soft_limits(soft_limits_of(machine.description(), machine.model(), reported_before));
  model_ = machine.shared_model();  // the former one is freed with its last user
  rebind(now);
  if (guard_) guard_->take_over(now);
  unbound_.clear();
  for (const Simulated& one : simulated_) use_sensors(*one.hardware, one.description, machine);
}

void ControlStack::carry_references(const Instance& before, Instance now) const {
  for (std::size_t j = 0; j < model_->joints.size(); ++j) {
    const int joint = static_cast<int>(j);
    if (!model_->joints[j].scalar() || model_->joints[j].mimics()) continue;
    // A drive that follows a trajectory has a target apart from its position; without it, an edit would let
    // the joint relax for a step.
    if (now.drive(joint) == DriveMode::position)
      now.set_drive_reference(joint, before.drive_reference(joint));
  }
}

void ControlStack::rebind(Instance instance) {
  for (const Simulated& one : simulated_) one.hardware->rebind(instance);
  for (SteppedDevice* const one : stepped_) one->rebind(instance);
  if (guard_) guard_->rebind(instance);
}

void ControlStack::restart_sensors() {
  for (const Simulated& one : simulated_) one.hardware->restart_sensors();
}

void ControlStack::state_written() {
  for (const Simulated& one : simulated_) one.hardware->state_written();
}

bool ControlStack::guide(std::string_view joint, double position) {
  return std::ranges::any_of(stepped_, [&](SteppedDevice* one) { return one->guide(joint, position); });
}

void ControlStack::before_step() {
  for (const Simulated& one : simulated_) one.hardware->before_step();
  for (SteppedDevice* const one : stepped_) one->before_step();
}

void ControlStack::after_step() {
  for (const Simulated& one : simulated_) one.hardware->after_step();
}

std::uint64_t ControlStack::with_sensors(std::uint64_t hash) const {
  for (const Simulated& one : simulated_)
    for (std::size_t i = 0; i < one.hardware->sensor_count(); ++i)
      if (one.hardware->readings()->repeatable(i)) hash = mixed(hash, one.hardware->readings()->values(i));
  return hash;
}

}  // namespace doppel
