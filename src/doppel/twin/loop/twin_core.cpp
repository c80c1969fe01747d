#include "doppel/twin/loop/twin_core.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "doppel/control/controllers/builtin.h"
#include "doppel/control/manager/plugin_library.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/scenario/schema/robot_names.h"
#include "doppel/twin/loop/detail/state_hash.h"
#include "doppel/twin/loop/divergence.h"

namespace doppel {
namespace {

constexpr Duration kClockSetBack{1'000'000'000};  // less is jitter

// Adds the wall-clock time of its lifetime to a sum.
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

std::shared_ptr<TwinSources> sources_of(Scenario scenario) {
  auto out = std::make_shared<TwinSources>(
      TwinSources{std::move(scenario), builtin_controllers(), HardwareRegistry::with_builtin()});
  if (out->scenario.hardware == HardwareUse::real) register_servo_hardware(out->hardware);
  for (const std::string& plugin : out->scenario.plugins)
    load_plugin_library(plugin, out->controllers, out->hardware);
  return out;
}

BusOptions bus_options(const Scenario& scenario, const Log& log) {
  return {.names = scenario.ros.names,
          .sim_time = !scenario.wall_stamps,
          .report = [&log](const std::string& problem) { log.error("bus", problem); },
          .twists = scenario.strict ? TwistPolicy::explain : TwistPolicy::convert,
          .advise = [&log](const std::string& advice) { log.warning("bus", advice); }};
}

}  // namespace

TwinCore::TwinCore(Scenario scenario, const Log& log, Diagnostics& diagnostics)
    : sources_(sources_of(std::move(scenario))),
      log_(log),
      bus_(bus_options(sources_->scenario, log)),
      statics_(static_transforms(sources_->scenario.transforms)),
      machine_(std::make_unique<CompiledScenario>(sources_->scenario, diagnostics)),
      objects_hash_(kEmptyHash),
      gone_hash_(kEmptyHash) {
  *earth_ = machine_->earth;
  follow_wall(now());
  for (const auto& robot : machine_->robots) robots_.push_back(make_robot(robot, nullptr, diagnostics));
  require_emulated_devices();
  renew_handles();
}

// A run that emulates nothing would look like one of the devices.
void TwinCore::require_emulated_devices() const {
  const HardwareUse use = scenario().hardware;
  if (use != HardwareUse::emulated && use != HardwareUse::ports) return;
  std::vector<std::string> components;
  for (const auto& robot : robots_) {
    if (robot->has_emulated_devices()) return;
    for (const HardwareDescription& one : robot->machine().hardware())
      components.push_back(fmt::format("'{}' has {}", one.name, one.plugin.empty() ? "none" : one.plugin));
  }
  if (scenario().emulation.servos)
    throw InputError("hardware.nothing_emulated", {},
                     "there is no servo to emulate: no joint has a position command",
                     "servos move revolute and prismatic joints; use doppel up without --emulate");
  throw InputError("hardware.nothing_emulated", {},
                   fmt::format("there is no servo to emulate: no component names a driver of servos as its "
                               "<plugin>; {}",
                               fmt::join(components, ", ")),
                   "--protocol feetech (dynamixel, servo_line) gives every joint a servo; doppel man "
                   "hardware lists the drivers");
}

void TwinCore::start() {
  for (const auto& robot : robots_) {
    robot->make_publishers();
    robot->start_first();
  }
  // Last, when all other objects are made, because the loops run concurrently.
  const std::lock_guard held(gate_);
  for (const auto& robot : robots_) robot->start_loop();
}

std::unique_ptr<TwinRobot> TwinCore::make_robot(std::shared_ptr<const CompiledRobot> robot,
                                                const TwinRobot* former, Diagnostics& diagnostics) {
  // Two robots whose managers share a node would serve the same services, and a request would reach either
  // of them. Remapping rules can cause this although the namespaces differ.
  const std::string manager = bus_.names().node(in_namespace(robot->name_space(), "controller_manager"));
  for (const auto& other : robots_) {
    if (other->name_space() == robot->name_space()) continue;  // the one that it replaces
    if (bus_.names().node(in_namespace(other->name_space(), "controller_manager")) != manager) continue;
    throw InputError("cli.ros_args", {},
                     fmt::format("the rules after --ros-args give the robots '{}' and '{}' the same node {}",
                                 other->name(), robot->name(), manager),
                     "remove __ns, and give each robot its namespace: --robot TARGET:NAMESPACE");
  }
  const Instance instance = instance_of(engine(), *robot);
  auto fresh = std::make_unique<TwinRobot>(
      TwinRobot::Surroundings{bus_, sources_->controllers, sources_->hardware, scenario(), log_, gate_,
                              statics_, earth_, ranges_, machine_->keep_out},
      std::move(robot), instance, former, diagnostics);
  // A robot that joins between two ticks of its rate is controlled in the next step, so that it does not
  // fall meanwhile.
  fresh->control_at_once(steps_);
  return fresh;
}

void TwinCore::exchange_machine(std::unique_ptr<CompiledScenario>& machine) {
  std::swap(machine_, machine);
  *earth_ = machine_->earth;
}

void TwinCore::renew_handles() {
  std::vector<std::string> names;
  std::string root;
  for (const auto& robot : robots_) {
    names.push_back(robot->name());
    if (robot->name_space().empty()) root = robot->name();
    robot->rebind(instance_of(engine(), robot->machine()));
  }
  scene_.show(engine(), std::move(names), std::move(root));
  // notice_instances() compares this with the engine's world and finds objects that were added or removed
  // since.
  seen_world_ = engine().compiled();
  parts_.instances_changed();
  parts_.advance_due_times(now());  // sensors that came
}

TwinRobot* TwinCore::find(std::string_view name_space) const {
  const auto found =
      std::ranges::find_if(robots_, [&](const auto& robot) { return robot->name_space() == name_space; });
  return found == robots_.end() ? nullptr : found->get();
}

TwinRobot* TwinCore::find_robot_with_loop() const {
  const auto found = std::ranges::find_if(robots_, [](const auto& robot) { return robot->has_loop(); });
  return found == robots_.end() ? nullptr : found->get();
}

std::map<std::string, ControllerSelection> TwinCore::present_selections() const {
  std::map<std::string, ControllerSelection> out;
  for (const auto& robot : robots_) out[robot->name_space()] = robot->present_selection();
  return out;
}

std::shared_ptr<const RunningMachine> TwinCore::running() const {
  auto out = std::make_shared<RunningMachine>();
  out->sources = sources_;
  out->robots = {machine_->robots, machine_->world.robots};
  out->selections = present_selections();
  out->world = engine().compiled();
  return out;
}

std::uint64_t TwinCore::state_hash() const {
  std::uint64_t hash = mixed(gone_hash_, objects_hash_);
  for (const auto& robot : robots_) hash = mixed(hash, robot->state_hash());
  return hash;
}

// The bus's time: that of a robot's ControlLoop, if there is one.
Time TwinCore::control_time() const {
  const TwinRobot* const real = find_robot_with_loop();
  return real == nullptr ? now() : real->control_time(now());
}

void TwinCore::step() {
  // A step starts no loop, so without one no lock is needed.
  const auto held = find_robot_with_loop() ? hold() : std::unique_lock(gate_, std::defer_lock);
  notice_instances();
  const Time begin = now();
  // Controllers run before the step, with the state at its beginning, and each robot at the rate of its own
  // manager.
  follow_wall(begin);
  for (const auto& robot : robots_) {
    if (!robot->control_due(steps_)) continue;
    const Stopwatch watch(phases_.control);
    robot->tick_control(steps_, begin);
  }
  for (const auto& robot : robots_) robot->before_step(steps_);
  parts_.before_step(begin);
  // Sensors that differentiate velocities take the state on both sides of the step.
  engine().step();
  ++steps_;
  ++steps_taken_;
  const Time end = now();
  parts_.after_step(end);
  bool due = parts_.is_due(end);
  for (const auto& robot : robots_) {
    robot->after_step(end);
    due = due || robot->publication_due(end);
  }
  // The state is hashed in each step, and not at the end only, so that two runs with equal hashes had equal
  // paths.
  hash_objects();
  if (due) publish_due(end);
}

// In the loop. The state of a fixed object is its pose.
void TwinCore::hash_objects() {
  for (const int index : scene_.objects()) {
    const Instance object = scene_.instance(index);
    if (object.v().empty()) {
      const auto matrix = object.root_pose().matrix().topRows<3>().eval();
      objects_hash_ = mixed(objects_hash_, {matrix.data(), static_cast<std::size_t>(matrix.size())});
    } else {
      objects_hash_ = mixed(mixed(objects_hash_, object.q()), object.v());
    }
  }
}

// In the loop. Wall-clock stamps follow the clock, and only decrease if the clock was set back.
void TwinCore::follow_wall(Time now) {
  if (bus_.sim_time()) return;
  const Time wall = system_time();
  if (wall < last_wall_ && last_wall_ - wall < kClockSetBack) return bus_.set_stamp_offset(last_wall_ - now);
  last_wall_ = wall;
  bus_.set_stamp_offset(wall - now);
}

// In the loop.
void TwinCore::publish_due(Time now) {
  const Stopwatch watch(phases_.publish);
  for (const auto& robot : robots_) {
    if (robot->publication_due(now)) robot->publish_due(now);
  }
  if (parts_.is_due(now)) parts_.publish_due(now);
}

void TwinCore::publish_state() {
  const auto held = hold();
  const Time present = now();
  bus_.set_now(present);
  follow_wall(present);
  parts_.show(present);
  for (const auto& robot : robots_) robot->show(present);
}

void TwinCore::state_written(const std::vector<int>& written) {
  for (const auto& robot : robots_) {
    if (std::ranges::find(written, robot->instance().index()) != written.end()) robot->state_written(now());
  }
  publish_state();
}

void TwinCore::between_steps() {
  const auto held = hold();
  bus_.set_now(control_time());
  follow_wall(now());
  settle_divergence();
  // The start ends with the first step, after which clients are served; until then the loop of real hardware
  // waits for its gate without being blocked.
  for (const auto& robot : robots_) {
    if (steps_taken_ > 0 || !robot->has_loop()) robot->settle(now());
  }
  bus_.spin();
  settle_divergence();
  notice_instances();
  const Time present = now();  // a request may have set it back
  for (const auto& robot : robots_) robot->between_steps(present);
  parts_.between_steps(present);
}

std::string TwinCore::divergence_text() const {
  const std::string motion = fastest_motion(engine()), loads = parts_.acting_loads();
  std::string out = fmt::format("the physics diverged in step {} (t = {:.3f} s)", steps_, to_seconds(now()));
  if (!motion.empty()) out += ": " + motion;
  if (!loads.empty()) out += "; " + loads;
  return out;
}

void TwinCore::settle_divergence() {
  if (!engine().diverged()) {
    if (time_control_.divergence.empty()) return;
    time_control_.divergence.clear();
    if (std::exchange(paused_by_divergence_, false)) time_control_.paused = false;
    log_.note("physics", fmt::format("the simulation can continue from t = {:.3f} s", to_seconds(now())));
    return;
  }
  if (!time_control_.divergence.empty()) return;  // reported
  // A part may remove the cause itself, such as a robot that was just spawned into another body. Otherwise
  // time stands still at the last finite state, which the user can inspect.
  const std::string cause = divergence_text();
  if (parts_.recover(cause) || !time_control_.pauses_at_divergence) return;
  time_control_.divergence = cause;
  time_control_.steps_owed = 0;
  paused_by_divergence_ = !std::exchange(time_control_.paused, true);
  log_.error("physics",
             cause + "; time is paused at the last finite state, and /gazebo/reset_simulation continues");
  publish_state();
}

void TwinCore::reset(Time time) {
  const auto held = hold();
  engine().reset();
  if (time != Time{}) engine().set_time(time);
  const Time present = now();
  bus_.set_now(present);
  follow_wall(present);
  parts_.reset(present);
  for (const auto& robot : robots_) robot->reset(present);
  publish_state();
  for (const auto& robot : robots_) robot->control_at_once(steps_);
}

void refuse_taken(const std::string& name_space) {
  throw InputError("up.namespace", {}, fmt::format("there is already a robot '{}'", name_space),
                   "choose another namespace, or delete it first");
}

void JoiningRobot::compile_into(std::shared_ptr<const CompiledWorld> world) {
  std::vector<ModelInstance> instances = world->instances();
  instances.push_back(machine->instance());
  Diagnostics reported_before;
  with = world->with(std::move(instances), reported_before);
  without = std::move(world);
}

void TwinCore::add_robot(JoiningRobot& joining) {
  const auto held = hold();
  const CompiledRobot& fresh = *joining.machine;
  if (find(fresh.name_space()) != nullptr) refuse_taken(fresh.name_space());
  if (joining.without != engine().compiled()) joining.compile_into(engine().compiled());
  // The world was compiled beside the loop. If another robot or object came meanwhile, that world is out of
  // date and is compiled again here.
  engine().continue_with(joining.with);
  const std::size_t before = robots_.size();
  try {
    if (const std::string why = spawned_divergence(engine()); !why.empty())
      throw InputError("up.diverges", fresh.description().source,
                       fmt::format("with the robot '{}' {}", fresh.name(), why),
                       "place it where it touches nothing, and check its masses and inertias");
    Diagnostics overlaps, reported_before;
    report_overlaps(fresh, engine(), overlaps);
    for (const Diagnostic& one : overlaps.all()) log_.warning("gazebo", one.str());
    robots_.push_back(make_robot(joining.machine, nullptr, reported_before));
    machine_->robots.push_back(joining.machine);
    renew_handles();
    robots_.back()->make_publishers();
    robots_.back()->start_first();
    robots_.back()->start_loop();
    // Nothing of a robot that cannot start stays: robots, world and handles are those before the call.
  } catch (...) {
    robots_.resize(before);
    machine_->robots.resize(before);
    engine().continue_with(joining.without);
    renew_handles();
    throw;
  }
  report_robots_changed();
}

Status TwinCore::remove_robot(const std::string& name_space) {
  const auto held = hold();
  TwinRobot* const robot = find(name_space);
  if (robot == nullptr) return Status::refused(fmt::format("there is no robot '{}'", name_space));
  if (name_space.empty() && !robot->machine().setup().from_plugins) {
    return Status::refused(fmt::format(
        "'{}' is the robot without a namespace, so its nodes and topics are those of the twin itself, "
        "and it cannot be deleted; a robot that is started in a namespace can be: doppel up --robot "
        "TARGET:NAMESPACE",
        robot->name()));
  }
  const std::string name = robot->name();
  // The path of a removed robot remains part of the hash, so that a run that deletes one differs from a run
  // that never had it.
  gone_hash_ = mixed(gone_hash_, robot->state_hash());
  std::erase_if(machine_->robots, [&](const auto& r) { return r->name_space() == name_space; });
  std::erase_if(robots_, [&](const auto& r) { return r->name_space() == name_space; });
  engine().remove(name);
  renew_handles();
  for (const auto& other : robots_) other->robots_changed(now());
  report_robots_changed();
  return {};
}

void rehearse(const CompiledRobot& compiled, Instance instance, const TwinSources& sources,
              const std::function<void(ControlStack&, const Log&)>& start, Diagnostics& diagnostics) {
  Bus bus({.names = sources.scenario.ros.names, .sim_time = !sources.scenario.wall_stamps});
  const Log quiet;
  const ControlStack::Options with{.controllers = sources.controllers,
                                   .hardware = sources.hardware,
                                   .enforce_limits = sources.scenario.enforce_limits,
                                   .use = HardwareUse::simulated,
                                   .rehearsal = true};
  ControlStack control(bus, compiled, instance, with, quiet, diagnostics);
  start(control, quiet);
  // Its publishers may throw, too.
  StatePublisher::Options options;
  options.name_space = compiled.name_space();
  options.tf = compiled.asked().tf;
  options.X_WR = compiled.instance().X_WR;
  options.file = &compiled.setup().controllers;
  const StatePublisher state(bus, compiled.description(), compiled.shared_model(), options);
}

}  // namespace doppel
