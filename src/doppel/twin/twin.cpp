#include "doppel/twin/twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "doppel/messages/rcl_interfaces.h"
#include "doppel/twin/simulator_services.h"
#include "doppel/twin/state_publisher.h"

namespace doppel {
namespace {

constexpr Duration kTransformPeriod{20'000'000};    // /tf at 50 Hz
constexpr Duration kClockPeriod{10'000'000};        // /clock at 100 Hz
constexpr Duration kHousekeepingPeriod{5'000'000};  // controllers choose slower rates of their own

std::uint64_t steps_in(Duration period, Duration step) {
  return std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>((period.count() + step.count() / 2) / step.count()));
}

std::uint64_t mixed(std::uint64_t hash, double value) {
  hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15ull;
  return hash ^ (hash >> 29);
}

}  // namespace

struct Twin::Impl {
  Impl(Scenario the_scenario, const Log& the_log, Diagnostics& diagnostics)
      : scenario(std::move(the_scenario)),
        log(the_log),
        machine(std::make_unique<Machine>(scenario, diagnostics)) {
    registry = ControllerRegistry::with_builtin();
    for (const std::string& plugin : scenario.plugins) registry.load_library(plugin);
    build_control(diagnostics);
    make_publisher();
    if (scenario.start_controllers) control->start(control->wish_of(scenario.activate), log);
  }

  // What is on the bus for the machine, but for what publishes its state.
  void build_control(Diagnostics& diagnostics) {
    control =
        std::make_unique<ControlStack>(bus, *machine, registry, scenario.enforce_limits, log, diagnostics);
    services = std::make_unique<SimulatorServices>(
        bus, control->model(), *machine->engine,
        SimulatorServices::Callbacks{[this] { reset(); },
                                     [this] { control->manager().restart(machine->engine->time()); }});
    const Duration step = machine->setup.world.step;
    steps_per_tick = static_cast<std::uint64_t>(control->manager().steps_per_tick());
    steps_per_transforms = steps_in(kTransformPeriod, step);
    steps_per_clock = steps_in(kClockPeriod, step);
    steps_per_housekeeping = steps_in(kHousekeepingPeriod, step);
    all_due_now();
  }

  void make_publisher() {
    publisher.reset();
    publisher = std::make_unique<StatePublisher>(bus, machine->setup.description.robot, control->model());
    publisher->publish_latched(machine->engine->time());
  }

  void all_due_now() { next_tick = next_transforms = next_clock = next_housekeeping = count; }

  // Controllers and services for the machine in place of those that are there, with the same pace of time.
  void rebuild_control(const ControllerWish& wish) {
    const TimeControl time = services->time_control();
    services.reset();
    control.reset();
    Diagnostics told_before;
    build_control(told_before);
    services->time_control() = time;
    control->start(wish, log);
  }

  Reload replace(Replacement& fresh);

  void step() {
    Engine* const engine = machine->engine.get();
    const Time now = engine->time();
    if (count == next_tick) {
      control->manager().tick(now);
      next_tick += steps_per_tick;
    }
    services->before_step(now);
    engine->step();
    ++count;
    const auto q = engine->q();
    for (const double value : q) hash = mixed(hash, value);
    for (const double value : engine->v()) hash = mixed(hash, value);
    for (const double value : engine->drive_effort()) hash = mixed(hash, value);
    if (count >= next_transforms) {
      publisher->publish_transforms(engine->time(),
                                    Eigen::Map<const Eigen::VectorXd>(q.data(), machine->model.nq));
      next_transforms += steps_per_transforms;
    }
    if (count >= next_clock) {
      publisher->publish_clock(engine->time());
      next_clock += steps_per_clock;
    }
  }

  void between_steps() {
    bus.set_now(machine->engine->time());
    bus.spin();
    if (count >= next_housekeeping) {
      control->manager().housekeeping(machine->engine->time());
      next_housekeeping = count + steps_per_housekeeping;
    }
  }

  void reset() {
    Engine& engine = *machine->engine;
    engine.reset();
    services->forget_loads();
    bus.set_now(engine.time());
    control->manager().restart(engine.time());
    publisher->publish_latched(engine.time());
    all_due_now();
  }

  const Scenario scenario;
  const Log& log;
  Bus bus;
  ControllerRegistry registry;
  std::unique_ptr<Machine> machine;
  std::unique_ptr<ControlStack> control;
  std::unique_ptr<StatePublisher> publisher;
  std::unique_ptr<SimulatorServices> services;

  std::uint64_t count = 0, hash = 0xCBF29CE484222325ull;
  std::uint64_t steps_per_tick = 1, steps_per_transforms = 1, steps_per_clock = 1, steps_per_housekeeping = 1;
  std::uint64_t next_tick = 0, next_transforms = 0, next_clock = 0, next_housekeeping = 0;
};

struct Twin::Replacement {
  std::unique_ptr<Machine> machine;
  ControllerWish wish;
};

Twin::Reload Twin::Impl::replace(Replacement& fresh) {
  refuse_lost_range(*machine, *fresh.machine);
  carry_over_state(*machine, *fresh.machine);
  std::swap(machine, fresh.machine);  // the old one waits there, to run on if controllers refuse the new one
  if (same_structure(*fresh.machine, *machine)) {
    control->take_over(*fresh.machine, *machine);
    services->rebind(*machine->engine);
    make_publisher();
    return Reload::controllers_went_on;
  }
  const ControllerWish before = control->present_wish();
  try {
    rebuild_control(fresh.wish);
  } catch (const InputError&) {
    std::swap(machine, fresh.machine);
    rebuild_control(before);
    throw;
  }
  make_publisher();
  return Reload::controllers_made_anew;
}

Twin::Twin(const Scenario& scenario, const Log& log, Diagnostics& diagnostics)
    : impl_(std::make_unique<Impl>(scenario, log, diagnostics)) {}

Twin::~Twin() = default;

void Twin::step() {
  impl_->step();
}
void Twin::between_steps() {
  impl_->between_steps();
}
void Twin::reset() {
  impl_->reset();
}
ControllerWish Twin::present_controllers() const {
  return impl_->control->present_wish();
}

namespace {

// What ran goes on where it is still declared; what the YAML declares newly is treated as at the start.
ControllerWish renewed(const ControllerWish& before,
                       const std::vector<std::pair<std::string, std::string>>& declared,
                       const Scenario& scenario) {
  ControllerWish wish = before;
  const auto gone = [&declared](const std::string& name) {
    return std::none_of(declared.begin(), declared.end(), [&name](const auto& d) { return d.first == name; });
  };
  std::erase_if(wish.active, gone);
  std::erase_if(wish.inactive, gone);
  for (const auto& [name, type] : declared) {
    const bool known =
        std::find(before.declared.begin(), before.declared.end(), name) != before.declared.end();
    if (known || !scenario.start_controllers) continue;
    (scenario.activate.empty() ? wish.active : wish.inactive).push_back(name);
  }
  return wish;
}

}  // namespace

std::shared_ptr<Twin::Replacement> Twin::prepare(const ControllerWish& wish, Diagnostics& diagnostics) const {
  auto fresh = std::make_shared<Replacement>();
  fresh->machine = std::make_unique<Machine>(impl_->scenario, diagnostics);
  // A rehearsal on a bus of its own: whatever controllers refuse, they refuse here.
  Bus bus;
  const Log quiet;
  ControlStack rehearsal(bus, *fresh->machine, impl_->registry, impl_->scenario.enforce_limits, quiet,
                         diagnostics);
  fresh->wish = renewed(wish, rehearsal.manager().declared_controllers(), impl_->scenario);
  rehearsal.start(fresh->wish, quiet);
  fresh->machine->engine->reset();
  return fresh;
}

Twin::Reload Twin::replace(const std::shared_ptr<Replacement>& replacement) {
  return impl_->replace(*replacement);
}

std::vector<std::filesystem::path> Twin::files() const {
  return impl_->machine->files(impl_->scenario);
}

Time Twin::now() const {
  return impl_->machine->engine->time();
}
std::uint64_t Twin::steps() const {
  return impl_->count;
}
std::uint64_t Twin::state_hash() const {
  return impl_->hash;
}
bool Twin::diverged() const {
  return impl_->machine->engine->diverged();
}
const std::string& Twin::robot_name() const {
  return impl_->control->model().name;
}
const std::string& Twin::controllers_origin() const {
  return impl_->machine->setup.controllers_origin;
}
const Model& Twin::model() const {
  return impl_->control->model();
}
const RobotDescription& Twin::description() const {
  return impl_->machine->setup.description.robot;
}
Engine& Twin::engine() {
  return *impl_->machine->engine;
}
ControllerManager& Twin::controller_manager() {
  return impl_->control->manager();
}
Bus& Twin::bus() {
  return impl_->bus;
}
TimeControl& Twin::time_control() {
  return impl_->services->time_control();
}
Duration Twin::step_size() const {
  return impl_->machine->setup.world.step;
}

std::vector<JointSnapshot> Twin::joints() const {
  std::vector<std::pair<std::string_view, double>> targets;
  impl_->control->manager().targets(targets);
  std::vector<JointSnapshot> out;
  const Engine& engine = *impl_->machine->engine;
  for (std::size_t j = 0; j < impl_->control->model().joints.size(); ++j) {
    const ModelJoint& joint = impl_->control->model().joints[j];
    if (!joint.scalar()) continue;
    JointSnapshot snapshot;
    snapshot.name = joint.name;
    snapshot.q = engine.q()[static_cast<std::size_t>(joint.q)];
    snapshot.v = engine.v()[static_cast<std::size_t>(joint.v)];
    snapshot.tau = engine.drive_effort()[j];
    snapshot.target = std::nan("");
    for (const auto& [name, target] : targets) {
      if (name == joint.name) snapshot.target = target;
      if (joint.mimics() &&
          name == impl_->control->model().joints[static_cast<std::size_t>(joint.mimic_leader)].name) {
        snapshot.target = joint.mimic_multiplier * target + joint.mimic_offset;
      }
    }
    snapshot.lower = joint.lower;
    snapshot.upper = joint.upper;
    snapshot.effort = joint.effort;
    snapshot.mimics = joint.mimics();
    out.push_back(std::move(snapshot));
  }
  return out;
}

std::vector<SagReport> Twin::gravity_sag() const {
  Data data(impl_->control->model());
  const auto q = impl_->machine->engine->q();
  const Eigen::Map<const Eigen::VectorXd> configuration(q.data(), impl_->control->model().nq);
  std::vector<SagReport> out;
  StaticSag found;
  static_sag(impl_->control->model(), data, impl_->machine->servos, configuration,
             impl_->machine->gravity_R(), found);
  for (const Sag& sag : found.sags) {
    out.push_back({impl_->control->model().joints[static_cast<std::size_t>(sag.joint)].name, sag.torque,
                   sag.sag, sag.margin});
  }
  return out;
}

}  // namespace doppel
