#include "doppel/twin/loop/control_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "doppel/base/core/unavailable_error.h"
#include "doppel/base/yaml/yaml_text.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/control/manager/rates.h"
#include "doppel/twin/loop/detail/state_hash.h"

namespace doppel {
namespace {

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

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string quoted_names(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += fmt::format("{}'{}'", out.empty() ? "" : ", ", name);
  return out;
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
  add_hardware(bus, machine, instance, options, log, diagnostics);
  diagnostics.throw_if_errors();
  if (!absent_.empty()) throw UnavailableError(std::move(absent_));
  if (options.former != nullptr) resume_sensors(*options.former);
}

void ControlStack::start(const ControllerSelection& selection, const Log& log) {
  if (!awaited_.empty()) {
    waiting_ = selection;
    for (const Awaited& one : awaited_)
      log.note(kManager, fmt::format("hardware '{}' and the controllers start with {}", one.name,
                                     one.hardware->awaits()));
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
