#include "doppel/twin/twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>

#include "doppel/control/control_loop.h"
#include "doppel/control/plugin_library.h"
#include "doppel/messages/rcl_interfaces.h"
#include "doppel/twin/contact_publisher.h"
#include "doppel/twin/controllers_choice.h"
#include "doppel/twin/entity_mesh.h"
#include "doppel/twin/entity_services.h"
#include "doppel/twin/load_publisher.h"
#include "doppel/twin/object_publisher.h"
#include "doppel/twin/oscillation_watch.h"
#include "doppel/twin/simulator_services.h"
#include "doppel/twin/state_publisher.h"

namespace doppel {
namespace {

constexpr Duration kClockSetBack{1'000'000'000};  // less is jitter
constexpr const char* kRestOrigin = "physics";
constexpr std::size_t kUnrestShown = 5;
constexpr Duration kClockPeriod{10'000'000};        // /clock at 100 Hz
constexpr Duration kHousekeepingPeriod{5'000'000};  // controllers choose slower rates of their own

std::uint64_t steps_in(Duration period, Duration step) {
  return std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>((period.count() + step.count() / 2) / step.count()));
}

// Adds the wall time of its life to a sum.
class Stopwatch {
 public:
  explicit Stopwatch(std::chrono::nanoseconds& sum) : sum_(sum) {}
  ~Stopwatch() { sum_ += std::chrono::steady_clock::now() - begin_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  std::chrono::nanoseconds& sum_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

std::uint64_t mixed(std::uint64_t hash, double value) {
  hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15ull;
  return hash ^ (hash >> 29);
}

}  // namespace

struct Twin::Impl {
  Impl(Scenario the_scenario, const Log& the_log, Diagnostics& diagnostics)
      : scenario(std::move(the_scenario)),
        log(the_log),
        bus({.names = scenario.ros.names,
             .sim_time = !scenario.wall_stamps,
             .report = [&the_log](const std::string& problem) { the_log.error("bus", problem); }}),
        machine(std::make_unique<Machine>(scenario, diagnostics)),
        objects(bus),
        rest(*machine->engine) {
    follow_wall(machine->engine->time());
    registry = ControllerRegistry::with_builtin();
    hardware_registry = HardwareRegistry::with_builtin();
    for (const std::string& plugin : scenario.plugins)
      load_plugin_library(plugin, registry, hardware_registry);
    build_control(diagnostics);
    make_publishers();
    if (scenario.start_controllers) control->start(control->wish_of(scenario.activate), log);
    start_loop();
  }

  ~Impl() { loop.reset(); }  // before anything that it could be using goes
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // What is on the bus for the machine, but for what publishes its state.
  void build_control(Diagnostics& diagnostics) {
    const ControlStack::Options options{registry, hardware_registry, scenario.enforce_limits};
    control = std::make_unique<ControlStack>(bus, *machine, options, log, diagnostics);
    services = std::make_unique<SimulatorServices>(
        bus, control->model(), *machine->engine,
        SimulatorServices::Callbacks{[this] { reset(); },
                                     [this] {
                                       control->manager().restart(control_time());
                                       publish_state();
                                     }});
    entities = std::make_unique<EntityServices>(
        bus, control->model(), *machine->engine, log,
        EntityServices::Callbacks{[this](const std::string& uri) {
                                    return find_entity_mesh(uri, machine->resolver, machine->setup.target);
                                  },
                                  [this] {
                                    services->forget_loads_of_gone_objects();
                                    objects.at_once();
                                  }});
    const Duration step = machine->setup.world.step;
    steps_per_tick = steps_in(control->manager().period(), step);
    steps_per_clock = steps_in(kClockPeriod, step);
    steps_per_housekeeping = steps_in(kHousekeepingPeriod, step);
    all_due_now();
  }

  // What tells of the machine; anew for every machine.
  void make_publishers() {
    publisher.reset();
    loads.reset();
    contacts.reset();
    oscillations.reset();
    publisher = std::make_unique<StatePublisher>(bus, machine->setup.description.robot, control->model(),
                                                 machine->setup.world.X_WR, &machine->setup.controllers);
    loads = std::make_unique<LoadPublisher>(bus, control->model(), machine->servos, machine->gravity_R());
    contacts = std::make_unique<ContactPublisher>(bus, control->model());
    oscillations = std::make_unique<OscillationWatch>(control->model());
    objects.at_once();
    publisher->publish_latched(machine->engine->time());
  }

  void all_due_now() { next_tick = next_transforms = next_clock = next_housekeeping = count; }

  // Controllers and services for the machine in place of those that are there, with the same pace of time.
  void rebuild_control(const ControllerWish& wish) {
    const TimeControl time = services->time_control();
    entities.reset();
    services.reset();
    loop.reset();
    control.reset();
    Diagnostics told_before;
    build_control(told_before);
    services->time_control() = time;
    control->start(wish, log);
    start_loop();
  }

  Reload replace(Replacement& fresh);

  // A loop of its own is kept out; without one nothing is waited for.
  [[nodiscard]] std::unique_lock<LoopGate> hold() {
    return loop ? std::unique_lock(gate) : std::unique_lock<LoopGate>();
  }

  // What the controllers call now: a loop of its own goes on where the simulation is paused.
  [[nodiscard]] Time control_time() const { return loop ? loop->now() : machine->engine->time(); }

  // Real hardware is served by the wall's clock, beside the simulation.
  void start_loop() {
    if (!control->has_real_hardware()) return;
    const LoopWish wish = control->manager().loop_wish();
    loop = std::make_unique<ControlLoop>(
        control->manager(), gate, machine->engine->time(),
        ControlLoopOptions{wish.thread_priority, wish.lock_memory, Duration{}}, log);
  }

  void step() {
    const auto held = hold();
    Engine* const engine = machine->engine.get();
    const Time now = engine->time();
    follow_wall(now);
    if (count == next_tick) {
      const Stopwatch watch(phases.control);
      if (!loop) control->manager().tick(now);
      next_tick += steps_per_tick;
    }
    services->before_step(now);
    engine->step();
    ++count;
    oscillations->look(*engine, engine->time());
    const auto q = engine->q();
    for (const double value : q) hash = mixed(hash, value);
    for (const double value : engine->v()) hash = mixed(hash, value);
    for (const double value : engine->drive_effort()) hash = mixed(hash, value);
    if (count >= next_transforms || count >= next_clock) publish_due();
  }

  // In the loop. Stamps of the wall's time follow it, but run backwards only where the clock was set back.
  void follow_wall(Time now) {
    if (bus.sim_time()) return;
    const Duration wall = std::chrono::system_clock::now().time_since_epoch();
    if (wall < last_wall && last_wall - wall < kClockSetBack) return bus.set_stamp_offset(last_wall - now);
    last_wall = wall;
    bus.set_stamp_offset(wall - now);
  }

  // In the loop.
  void publish_due() {
    const Stopwatch watch(phases.publish);
    const Time now = machine->engine->time();
    if (count >= next_transforms) {
      publish_transforms(now);
      next_transforms += steps_in(publisher->period(), machine->setup.world.step);
    }
    if (count >= next_clock) {
      publisher->publish_clock(now);
      next_clock += steps_per_clock;
    }
  }

  void publish_transforms(Time now) {
    publisher->publish_transforms(
        now, Eigen::Map<const Eigen::VectorXd>(machine->engine->q().data(), machine->model.nq));
  }

  void publish_state() {
    const auto held = hold();
    const Time now = machine->engine->time();
    bus.set_now(now);
    follow_wall(now);
    publisher->publish_clock(now);
    publish_transforms(now);
    control->manager().publish_state(control_time());
    loads->at_once();
    contacts->at_once();
    objects.at_once();
  }

  void between_steps() {
    const auto held = hold();
    bus.set_now(control_time());
    follow_wall(machine->engine->time());
    if (loop) {
      loop->attend();
    } else {
      control->manager().settle(machine->engine->time());
    }
    bus.spin();
    services->answer_steps();
    const Time now = machine->engine->time();  // what came in may have set it back
    if (count >= next_housekeeping) {
      control->manager().housekeeping(control_time());
      next_housekeeping = count + steps_per_housekeeping;
      // Who asks for more transforms need not wait as long as they were rare.
      next_transforms =
          std::min(next_transforms, count + steps_in(publisher->period(), machine->setup.world.step));
    }
    if (scenario.start_controllers &&
        rest.look(machine->setup.description.robot, machine->model, *machine->engine))
      report_rest();
    if (oscillations->found()) report_oscillations();
    loads->publish_due(*machine->engine, now);
    contacts->publish_due(*machine->engine, now);
    objects.publish_due(control->model(), *machine->engine, now);
  }

  void report_rest() {
    if (!rest.report()) return;
    const std::vector<std::string>& complaints = rest.report()->complaints;
    for (std::size_t i = 0; i < std::min(complaints.size(), kUnrestShown); ++i) {
      log.warning(kRestOrigin, fmt::format("not at rest {:g} s after the start, without a command: {}",
                                           to_seconds(kRestTime), complaints[i]));
    }
    if (complaints.size() > kUnrestShown)
      log.warning(kRestOrigin, fmt::format("... and {} more joints", complaints.size() - kUnrestShown));
    const double speed = std::max(rest.report()->base_linear, rest.report()->base_angular);
    if (speed > kRestSpeed && complaints.empty()) {
      log.note(
          kRestOrigin,
          fmt::format("the floating base moves at {:.2g} m/s and {:.2g} rad/s: {} (--base fixed holds it)",
                      rest.report()->base_linear, rest.report()->base_angular,
                      rest.report()->base_touches ? "it tips over or slides, nothing balances it"
                                                  : "it falls, for it touches nothing"));
    }
  }

  void report_oscillations() {
    for (const Oscillation& found : oscillations->take()) {
      const Model& model = control->model();
      oscillation_reports.push_back({model.joints[static_cast<std::size_t>(found.joint)].name,
                                     to_string(found, model, *machine->engine, machine->setup.world.step)});
      log.warning(kRestOrigin, oscillation_reports.back().message);
    }
  }

  void reset() {
    const auto held = hold();
    Engine& engine = *machine->engine;
    engine.reset();
    services->forget_loads();
    bus.set_now(engine.time());
    follow_wall(engine.time());
    control->manager().restart(control_time());
    publisher->publish_latched(engine.time());
    publish_state();
    all_due_now();
  }

  const Scenario scenario;
  const Log& log;
  Bus bus;
  ControllerRegistry registry;
  HardwareRegistry hardware_registry;
  std::unique_ptr<Machine> machine;
  std::unique_ptr<ControlStack> control;
  LoopGate gate;
  std::unique_ptr<ControlLoop> loop;  // null: no hardware is real, step() ticks the manager
  std::unique_ptr<StatePublisher> publisher;
  std::unique_ptr<LoadPublisher> loads;
  std::unique_ptr<ContactPublisher> contacts;
  ObjectPublisher objects;
  RestCheck rest;
  std::unique_ptr<OscillationWatch> oscillations;
  std::vector<OscillationReport> oscillation_reports;
  std::unique_ptr<SimulatorServices> services;
  std::unique_ptr<EntityServices> entities;

  LoopPhases phases;
  Duration last_wall{};  // that stamps were made of
  std::uint64_t count = 0, hash = 0xCBF29CE484222325ull;
  std::uint64_t steps_per_tick = 1, steps_per_clock = 1, steps_per_housekeeping = 1;
  std::uint64_t next_tick = 0, next_transforms = 0, next_clock = 0, next_housekeeping = 0;
};

struct Twin::Replacement {
  std::unique_ptr<Machine> machine;
  ControllerWish wish;
};

Twin::Reload Twin::Impl::replace(Replacement& fresh) {
  const auto held = hold();
  refuse_lost_range(*machine, *fresh.machine);
  carry_over_state(*machine, *fresh.machine);
  std::swap(machine, fresh.machine);  // the old one waits there, to run on if controllers refuse the new one
  const auto go_on_with = [this](Machine& from) {
    control->take_over(from, *machine);
    services->rebind(*machine->engine);
    entities->rebind(*machine->engine);
    make_publishers();
  };
  const bool same = same_structure(*fresh.machine, *machine);
  const ControllerWish before = control->present_wish();
  try {
    if (same) {
      go_on_with(*fresh.machine);
    } else {
      rebuild_control(fresh.wish);
      make_publishers();
    }
  } catch (...) {  // what prepare() could not rehearse
    std::swap(machine, fresh.machine);
    if (same) {
      go_on_with(*fresh.machine);
    } else {
      rebuild_control(before);
      make_publishers();
    }
    throw;
  }
  publish_state();
  return same ? Reload::controllers_went_on : Reload::controllers_made_anew;
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
void Twin::publish_state() {
  impl_->publish_state();
}
const LoopPhases& Twin::step_phases() const {
  return impl_->phases;
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

// A file that was found, and that an edit has broken, emptied or deleted, is waited for: what it declares
// runs on. Throws InputError.
void refuse_lost_controllers(const RobotSetup& before, const RobotSetup& after, const Diagnostics& said) {
  if (before.controllers_named) return;
  const auto ours = [&before](const std::filesystem::path& file) {
    return std::ranges::find(before.controllers_files, file) != before.controllers_files.end();
  };
  for (const Diagnostic& d : said.all()) {
    if (d.rule == "up.controllers_unreadable" && d.where.known() && ours(*d.where.file))
      throw InputError(d.rule, d.where, d.message, d.mend);
  }
  for (const std::filesystem::path& file : before.declaring_files) {
    if (is_controllers_file(file)) continue;
    std::error_code none;
    const bool there = std::filesystem::exists(file, none);
    throw InputError("reload.controllers_lost", make_location(file.string()),
                     there ? "this file, which the running controllers come from, declares none any more"
                           : "this file, which the running controllers come from, does not exist any more",
                     "restore it; to run without it, start again");
  }
  if (!before.declaring_files.empty() && after.controllers_files.empty()) {
    throw InputError("reload.controllers_lost", make_location(before.declaring_files.front().string()),
                     "the controllers of this file, which run, would name no joint of this robot any more",
                     "correct the joints' names in it or in the description; to run without it, start again");
  }
}

}  // namespace

std::shared_ptr<Twin::Replacement> Twin::prepare(const ControllerWish& wish, Diagnostics& diagnostics) const {
  auto fresh = std::make_shared<Replacement>();
  fresh->machine = std::make_unique<Machine>(impl_->scenario, diagnostics, impl_->machine->base());
  refuse_lost_controllers(impl_->machine->setup, fresh->machine->setup, diagnostics);
  // A rehearsal on a bus of its own: whatever controllers refuse, they refuse here.
  Bus bus({.names = impl_->scenario.ros.names, .sim_time = !impl_->scenario.wall_stamps});
  const Log quiet;
  ControlStack rehearsal(
      bus, *fresh->machine,
      {impl_->registry, impl_->hardware_registry, impl_->scenario.enforce_limits, /*rehearsal=*/true}, quiet,
      diagnostics);
  fresh->wish = renewed(wish, rehearsal.manager().declared_controllers(), impl_->scenario);
  // What runs must run on, whoever chose it; what comes new may be left out where nobody chose it.
  ControllerWish ran = fresh->wish;
  ran.what_fits = false;
  std::erase_if(ran.active, [&](const std::string& name) {
    return std::find(wish.active.begin(), wish.active.end(), name) == wish.active.end();
  });
  rehearsal.start(ran, quiet);
  if (fresh->wish.what_fits) rehearsal.start(fresh->wish, quiet);
  // So do those who publish its state: what runs is let go for them only when they are known to come up.
  const Machine& machine = *fresh->machine;
  const StatePublisher state(bus, machine.setup.description.robot, rehearsal.model(),
                             machine.setup.world.X_WR, &machine.setup.controllers);
  const LoadPublisher loads(bus, rehearsal.model(), machine.servos, machine.gravity_R());
  const ContactPublisher contacts(bus, rehearsal.model());
  fresh->machine->engine->reset();
  return fresh;
}

Twin::Reload Twin::replace(const std::shared_ptr<Replacement>& replacement) {
  return impl_->replace(*replacement);
}

const RobotDescription& Twin::description(const Replacement& replacement) {
  return replacement.machine->setup.description.robot;
}
const std::vector<WorldObject>& Twin::objects(const Replacement& replacement) {
  return replacement.machine->engine->objects();
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
std::string Twin::controllers_origin() const {
  const RobotSetup& setup = impl_->machine->setup;
  const bool beside = !setup.controllers_files.empty() && impl_->control->has_generated();
  return setup.controllers_origin + (beside ? " and generated" : "");
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
  const auto held = impl_->hold();
  const ControllerManager& manager = impl_->control->manager();
  // What its position is to be: a command, or what a controller with another command follows.
  const auto target_of = [&manager](const ModelJoint& of) {
    const std::string position = of.name + "/" + kPosition;
    const double command = manager.command(position);
    return std::isfinite(command) ? command : manager.reference(position);
  };
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
    snapshot.target =
        joint.mimics()
            ? joint.mimic_multiplier *
                      target_of(
                          impl_->control->model().joints[static_cast<std::size_t>(joint.mimic_leader)]) +
                  joint.mimic_offset
            : target_of(joint);
    snapshot.lower = joint.lower;
    snapshot.upper = joint.upper;
    snapshot.effort = joint.effort;
    snapshot.mimics = joint.mimics();
    out.push_back(std::move(snapshot));
  }
  return out;
}

const std::vector<OscillationReport>& Twin::oscillations() const {
  return impl_->oscillation_reports;
}

const std::optional<RestReport>& Twin::rest() const {
  return impl_->rest.report();
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
                   sag.sag, sag.least, sag.most, sag.margin});
  }
  return out;
}

}  // namespace doppel
