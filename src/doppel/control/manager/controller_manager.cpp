#include "doppel/control/manager/controller_manager.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/detail/controller_manager.h"
#include "doppel/control/manager/distro_differences.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/bus/standard_node.h"

namespace doppel {
namespace {

Status not_negative(const ParameterValue& value) {
  const auto rate = std::get<std::int64_t>(value);
  return rate >= 0 ? Status{} : Status::refused(fmt::format("a rate cannot be negative: {}", rate));
}

// A controller of a plugin library may throw anything; the user gets it as one that cannot be loaded.
void initialise(LoadedController& c) {
  try {
    c.controller->on_init(c.context);
  } catch (const InputError&) {
    throw;
  } catch (...) {
    throw InputError("control.on_init", {}, fmt::format("cannot initialise '{}': {}", c.name, thrown_text()));
  }
}

}  // namespace

std::string_view to_string(ControllerState state) {
  switch (state) {
    case ControllerState::unconfigured:
      return "unconfigured";
    case ControllerState::inactive:
      return "inactive";
    case ControllerState::active:
      return "active";
  }
  return "unconfigured";
}

ControllerManager::Impl::Impl(Bus& the_bus, const Model& the_model, const ControllerRegistry& the_registry,
                              const ParameterFile* the_file, ControllerManagerOptions the_options,
                              const Log& the_log, Diagnostics& diagnostics)
    : bus(the_bus),
      model(&the_model),
      registry(the_registry),
      file(the_file),
      options(std::move(the_options)),
      log(the_log),
      node(bus, options.name_space + "/" + options.name),
      own(file == nullptr ? ParameterOverrides{} : file->overrides_for(node.name(), node.given_name())),
      limiter(the_model),
      guarded(options.guard) {
  make_standard(node);
  serve_logger_levels(node);
  node.parameters().allow_undeclared();  // spawners set the type of a controller that no file declares
  read_own_parameters(diagnostics);
  limiter.enforce(options.enforce_limits);
  serve();
}

ControllerManager::Impl::~Impl() {
  shut_down_hardware();
  bus.names().remove_all_of(this);
}

LoadedController* ControllerManager::Impl::find(std::string_view name) const {
  for (const auto& candidate : loaded) {
    if (candidate->name == name) return candidate.get();
  }
  return nullptr;
}

LoadedController& ControllerManager::Impl::at(std::string_view name) const {
  if (LoadedController* found = find(name)) return *found;
  std::vector<std::string> names;
  for (const auto& candidate : loaded) names.push_back(candidate->name);
  throw InputError("control.not_loaded", {},
                   fmt::format("no controller '{}' is loaded{}", name, did_you_mean(name, names)));
}

std::string ControllerManager::Impl::type_of(const std::string& name) {
  constexpr std::string_view kSuffix = ".type";
  std::vector<std::string> names;
  for (const auto& parameter : node.parameters().all()) {
    if (!parameter.name.ends_with(kSuffix)) continue;
    names.push_back(parameter.name.substr(0, parameter.name.size() - kSuffix.size()));
    if (names.back() != name) continue;
    if (const auto* type = std::get_if<std::string>(&parameter.value)) return *type;
    throw InputError("control.no_type", {},
                     fmt::format("the parameter '{}' of {} is {}, but a controller type must be a string",
                                 parameter.name, node.name(), parameter_type_name(parameter.value)));
  }
  throw InputError(
      "control.no_type", file == nullptr ? SourceLocation{} : make_location(file->name()),
      fmt::format("no type is given for the controller '{}'{}", name, did_you_mean(name, names)),
      fmt::format("declare it: {}: {{ros__parameters: {{{}: {{type: ...}}}}}}", options.name, name));
}

void ControllerManager::Impl::choose_rate(LoadedController& c) {
  const ParameterOverride* written = c.overrides.find("update_rate");
  const auto asked = declare<std::int64_t>(c.node->parameters(), &c.overrides, "update_rate", 0,
                                           {"Hz; 0: the controller manager's", true, not_negative});
  declare<bool>(c.node->parameters(), &c.overrides, "is_async", false,
                {"not used: all controllers run in one loop", true, {}});
  declare<std::int64_t>(c.node->parameters(), &c.overrides, "thread_priority", -100,
                        {"not used: all controllers run in one loop", true, {}});
  // A controller runs in whole ticks of the manager; a rate that does not divide the manager's is rounded.
  const double rate = asked == 0 ? rate_of(period) : static_cast<double>(asked);
  c.ticks_per_update = steps_per_period(rate, period);
  c.period = period * c.ticks_per_update;
  c.context.update_rate = rate_of(c.period);
  if (asked != 0 && differs(rate, c.context.update_rate)) {
    log_diagnostic(
        log, c.name,
        {Severity::warning, "control.rate_rounded",
         fmt::format("{:g} Hz does not divide the controller manager's {:g} Hz; '{}' is updated every {} "
                     "tick{}, at {:g} Hz",
                     rate, rate_of(period), c.name, c.ticks_per_update, c.ticks_per_update == 1 ? "" : "s",
                     c.context.update_rate),
         written->source, fmt::format("choose a rate that divides {:g}", rate_of(period))});
  }
}

// A `type` next to the controller's parameters is read by spawners; the controller's node declares it, as
// in ROS 2.
void ControllerManager::Impl::declare_written_type(LoadedController& c) {
  const ParameterOverride* written = c.overrides.find("type");
  if (written == nullptr) return;
  const ParameterValue value = declare_parameter(c.node->parameters(), &c.overrides, "type", written->value,
                                                 {.description = "as the file says", .dynamic_typing = true});
  if (value == ParameterValue(c.type)) return;
  log_diagnostic(log, c.name,
                 {Severity::warning, "control.other_type",
                  fmt::format("the type '{}' has no effect here: '{}' is a '{}', as given to {}",
                              to_string(value), c.name, c.type, options.name),
                  written->source, "write the same type in both places"});
}

void ControllerManager::Impl::load(const std::string& name, const std::string& given_type) {
  if (const Status fine = check_node_name(name); !fine) {
    throw InputError("control.bad_name", {},
                     fmt::format("'{}' is not a valid controller name: {}", name, fine.why()));
  }
  if (find(name) != nullptr) {
    throw InputError("control.loaded_already", {}, fmt::format("a controller '{}' is already loaded", name));
  }
  // The rules of a controller's node_options_args apply to its topics from the first one on, and are removed
  // if it cannot be made.
  const NodeArguments arguments = arguments_of(name, expand_name(name, node.given_name()));
  use_rules(name, arguments.rules);
  try {
    loaded.push_back(make(name, given_type, arguments));
  } catch (...) {
    use_rules(name, {});
    throw;
  }
  publish_activity();
}

SourceLocation ControllerManager::Impl::where_written(const std::string& name,
                                                      const std::string& type) const {
  const auto place = std::find_if(own.all().begin(), own.all().end(), [&](const auto& o) {
    return o.name == name + ".type" && o.value == ParameterValue(type);
  });
  return place == own.all().end() ? SourceLocation{} : place->source;
}

// It works here, and would not be found by the manager of the process's distribution.
void ControllerManager::Impl::report_type_of_other_distro(const std::string& type,
                                                          SourceLocation where) const {
  const ControllerTypeRow* const row = find_ros2_type(type);
  if (row == nullptr || row->range.contains(ros_distro())) return;
  log_diagnostic(log, options.name,
                 {Severity::warning, "control.not_in_distro",
                  fmt::format("the controller type '{}' is not in {}", type, title(ros_distro())),
                  std::move(where), fmt::format("use {}", row->instead)});
}

std::unique_ptr<LoadedController> ControllerManager::Impl::make(const std::string& name,
                                                                const std::string& given_type,
                                                                const NodeArguments& arguments) {
  const auto nodes = bus.nodes();
  auto its_node = std::make_unique<Node>(bus, expand_name(name, node.given_name()));
  if (std::find(nodes.begin(), nodes.end(), its_node->name()) != nodes.end()) {
    throw InputError("control.bad_name", {},
                     fmt::format("a node '{}' already exists; a controller needs a node name of its own",
                                 its_node->name()));
  }
  const std::string type_name = given_type.empty() ? type_of(name) : given_type;
  // An unknown type is reported where it is written; one of ROS 2 that is missing here has a message of its
  // own.
  const ControllerRegistry::Type* type = registry.find(type_name);
  if (type == nullptr) {
    const SourceLocation where = where_written(name, type_name);
    if (find_ros2_type(type_name) != nullptr) {
      throw InputError(
          "control.type_not_available", where,
          fmt::format("the controller type '{}' of {} is not available here", type_name, title(ros_distro())),
          "remove it from the file, or load a library that provides it with --plugin LIBRARY");
    }
    throw InputError("control.unknown_type", where,
                     fmt::format("there is no controller type '{}'{}", type_name,
                                 did_you_mean(type_name, registry.names())),
                     "correct the type, or load the library that provides it with --plugin");
  }
  report_type_of_other_distro(type_name, where_written(name, type_name));
  // The node has its parameters before the controller declares its own, as in ros2_control.
  auto c = std::make_unique<LoadedController>();
  c->name = name;
  c->type = type_name;
  c->node = std::move(its_node);
  c->overrides = overrides_of(*c, arguments);
  make_standard(*c->node);
  serve_logger_levels(*c->node);
  c->node->parameters().allow_undeclared();
  c->transitions = c->node->advertise<lifecycle_msgs::msg::TransitionEvent>("~/transition_event");
  c->fallback = texts_of(name + kFallback);
  c->context = {name, c->node.get(), model, &log, &c->overrides, 0.0, type_name, options.guard};
  choose_rate(*c);
  declare_written_type(*c);
  c->controller = type->make();
  initialise(*c);
  // What the file gives and nothing has declared is probably misspelled.
  Diagnostics unused;
  report_unused(c->overrides, name, c->node->parameters().names(), unused);
  for (const Diagnostic& finding : unused.all()) log_diagnostic(log, name, finding);
  return c;
}

void ControllerManager::Impl::use_rules(const std::string& controller,
                                        const std::vector<std::string>& rules) {
  // Managers of other namespaces can have a controller of the same name.
  const NameRules::Owner owner{this, controller, expand_name(controller, node.given_name())};
  bus.names().remove(owner);
  for (const std::string& rule : rules) bus.names().add(rule, owner);
}

void ControllerManager::Impl::configure(LoadedController& c) {
  if (c.state == ControllerState::active) {
    throw InputError("control.configure", {},
                     fmt::format("'{}' is active; deactivate it before configuring it", c.name));
  }
  // A configured controller is cleaned up first, as by the transition of a lifecycle node.
  if (c.state == ControllerState::inactive) {
    if (const Status cleaned = attempt([&] { return c.controller->on_cleanup(); }); !cleaned) {
      throw InputError("control.configure", {},
                       fmt::format("cannot clean up '{}': {}", c.name, cleaned.why()));
    }
    withdraw_references(c);
    change_state(c, ControllerState::unconfigured);
  }
  Status configured;
  try {
    configured = c.controller->on_configure();
  } catch (const InputError&) {
    throw;  // with its place
  } catch (...) {
    configured = Status::refused(thrown_text());
  }
  if (!configured) {
    throw InputError("control.configure", {},
                     fmt::format("cannot configure '{}': {}", c.name, configured.why()));
  }
  // "All" means the interfaces that exist now; those of controllers that are configured later do not count.
  const auto expanded = [](InterfaceConfiguration wanted, const std::vector<std::string>& all) {
    if (wanted.kind == InterfaceConfiguration::Kind::all) return all;
    if (wanted.kind == InterfaceConfiguration::Kind::none) return std::vector<std::string>{};
    return std::move(wanted.names);
  };
  c.commands = expanded(c.controller->command_interfaces(), resources.command_names());
  c.states = expanded(c.controller->state_interfaces(), resources.state_names());
  offer_references(c);
  c.housekeeping_period = from_seconds(1.0 / std::max(c.controller->housekeeping_rate(), 1e-3));
  change_state(c, ControllerState::inactive);
  publish_activity();
}

Status ControllerManager::Impl::configure(const std::string& name) {
  try {
    configure(at(name));
    return {};
  } catch (const InputError& problem) {
    return Status::refused(problem.diagnostics().empty() ? problem.what()
                                                         : problem.diagnostics().front().message);
  }
}

Status ControllerManager::Impl::cleanup(const std::string& name) {
  LoadedController* c = find(name);
  if (c == nullptr) return Status::refused(fmt::format("no controller '{}' is loaded", name));
  if (c->state == ControllerState::active) return Status::refused(fmt::format("'{}' is active", name));
  if (c->state == ControllerState::unconfigured) return {};
  if (Status status = attempt([&] { return c->controller->on_cleanup(); }); !status) return status;
  withdraw_references(*c);
  change_state(*c, ControllerState::unconfigured);
  c->commands.clear();
  c->states.clear();
  publish_activity();
  return {};
}

Status ControllerManager::Impl::unload(const std::string& name) {
  LoadedController* c = find(name);
  if (c == nullptr) return Status::refused(fmt::format("no controller '{}' is loaded", name));
  if (c->state == ControllerState::active) {
    return Status::refused(fmt::format("'{}' is active; deactivate it before unloading it", name));
  }
  if (Status status = cleanup(name); !status) return status;
  std::erase_if(loaded, [&](const auto& candidate) { return candidate.get() == c; });
  use_rules(name, {});
  publish_activity();
  return {};
}

// Reads, updates, limits, writes. An exception of a controller is noted here and reported between the steps,
// where it may allocate.
void ControllerManager::Impl::tick(Time the_time) {
  now = the_time;
  // A controller is updated in the tick in which its countdown ends. Those that others write references of
  // stand behind them in `active`, so that a chain is updated within one tick.
  resources.read(now);
  for (LoadedController* c : active) {
    if (--c->ticks_to_update > 0) continue;
    c->ticks_to_update = c->ticks_per_update;
    try {
      c->controller->update(now, c->period);
    } catch (...) {
      note_thrown(c->thrown);
      controller_failed = true;
    }
  }
  // Limits apply to claimed commands once for each tick, after all controllers, because one command may be
  // a reference that another controller has changed.
  limiter.apply(now, period);
  guarded.apply();
  resources.write(now);
}

void ControllerManager::Impl::housekeeping(Time the_time) {
  now = the_time;
  for (LoadedController* c : active) {
    if (now < c->next_housekeeping) continue;
    c->controller->housekeeping(now);
    c->next_housekeeping = std::max(c->next_housekeeping + c->housekeeping_period, now);
  }
  limiter.report(now, log);
  guarded.attend(period);
  resources.attend();
  publish_diagnostics();
}

void ControllerManager::Impl::publish_state(Time the_time) {
  now = the_time;
  resources.read_all(now);
  for (LoadedController* c : active) c->controller->publish_state(now);
}

// -- the public class

ControllerManager::ControllerManager(Bus& bus, const Model& model, const ControllerRegistry& registry,
                                     const ParameterFile* file, ControllerManagerOptions options,
                                     const Log& log, Diagnostics& diagnostics)
    : impl_(std::make_unique<Impl>(bus, model, registry, file, std::move(options), log, diagnostics)) {}

ControllerManager::~ControllerManager() = default;

Status ControllerManager::add_hardware(std::unique_ptr<HardwareComponent> hardware,
                                       const HardwareDescription& description, Diagnostics& diagnostics) {
  return impl_->add_hardware(std::move(hardware), description, diagnostics);
}

std::vector<std::pair<std::string, std::string>> ControllerManager::declared_controllers() const {
  return impl_->declared();
}
void ControllerManager::load(const std::string& name, const std::string& type) {
  impl_->load(name, type);
}
Status ControllerManager::configure(const std::string& name) {
  return impl_->configure(name);
}
Status ControllerManager::switch_controllers(std::span<const std::string> activate,
                                             std::span<const std::string> deactivate, Strictness strictness) {
  return impl_->switch_controllers(activate, deactivate, strictness);
}
Status ControllerManager::unload(const std::string& name) {
  return impl_->unload(name);
}
void ControllerManager::start(std::span<const std::string> names) {
  impl_->start(names);
}
void ControllerManager::start_compatible(std::span<const std::string> names) {
  impl_->start_compatible(names);
}
void ControllerManager::model_changed(const Model& model) {
  impl_->model = &model;
  for (const auto& c : impl_->loaded) c->context.model = &model;
  impl_->limiter.model_changed(model);
}
Duration ControllerManager::period() const {
  return impl_->period;
}
void ControllerManager::set_soft_limits(std::vector<SoftLimits> limits) {
  impl_->limiter.set_soft_limits(std::move(limits));
}
void ControllerManager::tick(Time now) {
  impl_->tick(now);
}
void ControllerManager::settle(Time now) {
  impl_->settle(now);
}
void ControllerManager::stop(const std::string& by) {
  impl_->stop(by);
}
Status ControllerManager::reset_stop() {
  return impl_->reset_stop();
}
bool ControllerManager::is_stopped() const {
  return impl_->stopped;
}
const std::vector<std::string>& ControllerManager::stopped_controllers() const {
  return impl_->stopped_controllers;
}
void ControllerManager::housekeeping(Time now) {
  impl_->housekeeping(now);
}
void ControllerManager::publish_state(Time now) {
  impl_->publish_state(now);
}
void ControllerManager::restart(Time now) {
  impl_->restart(now);
}

std::vector<ControllerView> ControllerManager::controllers() const {
  std::vector<ControllerView> out;
  for (const auto& c : impl_->loaded) {
    const bool holds = c->state == ControllerState::active;
    out.push_back({c->name, c->type, c->state, c->context.update_rate,
                   holds ? c->commands : std::vector<std::string>{}, c->commands, c->states,
                   c->controller->reference_interfaces(), c->chained});
  }
  return out;
}

std::vector<HardwareView> ControllerManager::hardware() const {
  std::vector<HardwareView> out;
  for (const auto& c : impl_->resources.components())
    out.push_back({c->name, c->type, c->plugin, c->state, c->why});
  return out;
}

bool ControllerManager::report(std::size_t component, DeviceReport& out) const {
  ResourceTable::Component& hardware = *impl_->resources.components().at(component);
  bool reported = false;
  impl_->resources.call(hardware, "report",
                        [&](HardwareComponent& device) { reported = device.report(out); });
  return reported;
}

Status ControllerManager::set_hardware_state(const std::string& component, HardwareState target) {
  return impl_->set_hardware_state(component, target);
}

Status ControllerManager::relax_hardware(const std::string& component) {
  return impl_->without_drives(component, "the release of its joints",
                               [](HardwareComponent& hardware) { return hardware.relax(); });
}

Status ControllerManager::release_joint(const JointRelease& release) {
  return impl_->release_joint(release);
}

Status ControllerManager::confirm_pose(const std::string& component,
                                       std::span<const std::pair<std::string, double>> positions) {
  return impl_->without_drives(component, "the confirmation of its pose",
                               [&](HardwareComponent& hardware) { return hardware.confirm_pose(positions); });
}

std::vector<InterfaceView> ControllerManager::command_interfaces() const {
  std::vector<InterfaceView> out;
  for (const std::size_t i : impl_->resources.commands()) {
    out.push_back({impl_->resources.command_name(i), impl_->resources.command_available(i),
                   impl_->resources.claimed_by(i)});
  }
  return out;
}

std::vector<InterfaceView> ControllerManager::state_interfaces() const {
  std::vector<InterfaceView> out;
  const auto names = impl_->resources.state_names();
  for (std::size_t i = 0; i < names.size(); ++i)
    out.push_back({names[i], impl_->resources.state_available(i), ""});
  return out;
}

double ControllerManager::command(std::string_view full_name) const {
  const auto command = impl_->resources.find_command(full_name);
  const bool held = command && !impl_->resources.claimed_by(*command).empty();
  return held ? impl_->resources.applied(*command) : kNaN;
}

double ControllerManager::state(std::string_view full_name) const {
  const auto state = impl_->resources.find_state(full_name);
  return state ? impl_->resources.state(*state) : kNaN;
}

bool ControllerManager::is_read(std::string_view state_interface) const {
  const auto state = impl_->resources.find_state(state_interface);
  return state && impl_->resources.state_available(*state);
}

const BaseTransform* ControllerManager::base_transform() const {
  for (const LoadedController* c : impl_->active) {
    if (const BaseTransform* base = c->controller->base_transform()) return base;
  }
  return nullptr;
}

double ControllerManager::reference(std::string_view interface) const {
  for (const LoadedController* c : impl_->active) {
    for (std::size_t i = 0; i < c->references.size(); ++i) {
      if (std::string_view(c->references[i]).substr(c->name.size() + 1) == interface)
        return c->controller->reference_handles[i].get();
    }
  }
  for (const LoadedController* c : impl_->active) {
    const double value = c->controller->followed_value(interface);
    if (std::isfinite(value)) return value;
  }
  return kNaN;
}

void ControllerManager::stall_hardware() noexcept {
  for (const auto& component : impl_->resources.components()) component->hardware->on_stall();
}

bool ControllerManager::has_active_hardware() const noexcept {
  return std::ranges::any_of(impl_->resources.components(),
                             [](const auto& one) { return one->state == HardwareState::active; });
}

LoopSettings ControllerManager::loop_settings() const {
  LoopSettings settings;
  if (const ParameterOverride* priority = impl_->own.find("thread_priority")) {
    if (const auto* value = std::get_if<std::int64_t>(&priority->value))
      settings.thread_priority = static_cast<int>(*value);
  }
  if (const ParameterOverride* lock = impl_->own.find("lock_memory")) {
    if (const auto* value = std::get_if<bool>(&lock->value)) settings.lock_memory = *value;
  }
  return settings;
}

void ControllerManager::report_loop(const LoopStatistics& statistics) {
  impl_->loop = statistics;
}

const LoopStatistics* ControllerManager::loop_statistics() const {
  return impl_->loop ? &*impl_->loop : nullptr;
}

}  // namespace doppel
