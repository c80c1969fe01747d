#include "doppel/twin/loop/twin.h"

#include <fmt/format.h>

#include "doppel/control/controllers/builtin.h"
#include "doppel/control/manager/plugin_library.h"
#include "doppel/scenario/schema/robot_names.h"
#include "doppel/twin/loop/detail/attachment_services.h"
#include "doppel/twin/loop/detail/clock_publisher.h"
#include "doppel/twin/loop/detail/contact_publisher.h"
#include "doppel/twin/loop/detail/divergence.h"
#include "doppel/twin/loop/detail/entity_mesh.h"
#include "doppel/twin/loop/detail/entity_services.h"
#include "doppel/twin/loop/detail/grasp_monitor.h"
#include "doppel/twin/loop/detail/sensor_ticks.h"
#include "doppel/twin/loop/detail/twin.h"
#include "doppel/twin/loop/detail/world_services.h"
#include "doppel/twin/loop/object_publisher.h"

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

// Reports once that the engine had no room for a contact.
class ContactRoomMonitor : public Tickable {
 public:
  ContactRoomMonitor(const Scene& scene, const Log& log) : scene_(scene), log_(log) {}

  void between_steps(Time now) override {
    if (reported_ || scene_.engine().dropped_contacts() == 0) return;
    reported_ = true;
    log_.warning(
        "physics",
        fmt::format("t = {:.3f} s: more shapes touch than the engine has room for; some contacts have "
                    "no effect, and bodies may sink into each other (use fewer or simpler shapes)",
                    to_seconds(now)));
  }
  void reset(Time /*now*/) override { reported_ = false; }

 private:
  const Scene& scene_;
  const Log& log_;
  bool reported_ = false;
};

}  // namespace

Twin::Impl::Impl(Twin& the_twin, Scenario the_scenario, const Log& the_log, Diagnostics& diagnostics)
    : twin(the_twin),
      sources(std::make_shared<TwinSources>(TwinSources{std::move(the_scenario), {}, {}})),
      log(the_log),
      bus({.names = scenario.ros.names,
           .sim_time = !scenario.wall_stamps,
           .report = [&the_log](const std::string& problem) { the_log.error("bus", problem); },
           .twists = scenario.strict ? TwistPolicy::explain : TwistPolicy::convert,
           .advise = [&the_log](const std::string& advice) { the_log.warning("bus", advice); }}),
      machine(std::make_unique<CompiledScenario>(scenario, diagnostics)) {
  *earth = machine->earth;
  follow_wall(machine->engine->time());
  controllers = builtin_controllers();
  hardware = HardwareRegistry::with_builtin();
  for (const std::string& plugin : scenario.plugins) load_plugin_library(plugin, controllers, hardware);
  for (const auto& robot : machine->robots) robots.push_back(make_robot(robot, nullptr, diagnostics));
  renew_handles();
  add_world_ticks();
  for (const auto& robot : robots) {
    robot->make_publishers();
    if (scenario.start_controllers) robot->start(robot->first_selection());
  }
  // Last, when all other objects are made, because the loops run concurrently.
  const std::lock_guard held(gate);
  for (const auto& robot : robots) robot->start_loop();
}

Twin::Impl::~Impl() {
  end_build();
}

std::unique_ptr<TwinRobot> Twin::Impl::make_robot(std::shared_ptr<const CompiledRobot> robot,
                                                  const TwinRobot* former, Diagnostics& diagnostics) {
  const std::string manager = bus.names().node(in_namespace(robot->name_space(), "controller_manager"));
  for (const auto& other : robots) {
    if (other->name_space() == robot->name_space()) continue;  // the one that it replaces
    if (bus.names().node(in_namespace(other->name_space(), "controller_manager")) != manager) continue;
    throw InputError("cli.ros_args", {},
                     fmt::format("the rules after --ros-args give the robots '{}' and '{}' the same node {}",
                                 other->name(), robot->name(), manager),
                     "remove __ns, and give each robot its namespace: --robot TARGET:NAMESPACE");
  }
  const Instance instance = instance_of(*machine->engine, *robot);
  auto made = std::make_unique<TwinRobot>(
      TwinRobot::Surroundings{bus, controllers, hardware, scenario, log, gate, statics, earth, ranges},
      std::move(robot), instance, former, diagnostics);
  made->control_at_once(count);
  return made;
}

void Twin::Impl::add_world_ticks() {
  SimulatorServices::Callbacks simulator;
  simulator.reset = [this] { reset(); };
  simulator.state_written = [this](const std::vector<int>& written) {
    for (const auto& robot : robots)
      if (std::ranges::find(written, robot->instance().index()) != written.end())
        robot->state_written(machine->engine->time());
    publish_state();
  };
  simulator.report = [this](const std::string& why) { log.warning("gazebo", why); };
  auto services = std::make_unique<SimulatorServices>(bus, scene, time_control, std::move(simulator));
  SimulatorServices& of_time = *services;
  time_services = services.get();
  ticks.add(std::move(services));
  EntityServices::Callbacks entities;
  entities.find_mesh = [this](const std::string& uri) {
    return find_entity_mesh(uri, machine->resolver,
                            robots.empty() ? Target{} : robots.front()->machine().setup().target);
  };
  entities.changed = [this] { renew_handles(); };
  entities.spawn_robot = [this](WorldRobot robot, SpawnedText text, const auto& done) {
    spawn_robot(std::move(robot), std::move(text), done);
  };
  entities.namespaces = [this] {
    std::vector<std::string> out;
    for (const auto& robot : robots) out.push_back(robot->name_space());
    return out;
  };
  entities.remove_robot = [this](int index) {
    for (const auto& robot : robots) {
      if (robot->instance().index() == index) return remove_robot(robot->name_space());
    }
    return Status::refused("this robot does not belong to the twin");
  };
  auto of_entities = std::make_unique<EntityServices>(bus, scene, log, std::move(entities));
  ticks.add(std::make_unique<WorldServices>(
      bus, scene, log, *of_entities, of_time,
      WorldServices::Callbacks{[this] { reset(); }, [this] { reset(machine->engine->time()); }}));
  ticks.add(std::move(of_entities));
  ticks.add(std::make_unique<ClockPublisher>(bus, scene));
  ticks.add(std::make_unique<ContactPublisher>(bus, scene));
  ticks.add(std::make_unique<ObjectPublisher>(bus, scene));
  ticks.add(std::make_unique<AttachmentServices>(bus, scene, log));
  ticks.add(std::make_unique<GraspMonitor>(bus, scene, log));
  ticks.add(std::make_unique<ContactRoomMonitor>(scene, log));
  SensorTicks::Sources sensor_sources;
  sensor_sources.robots = [this] {
    std::vector<std::shared_ptr<const CompiledRobot>> present;
    for (const auto& robot : robots) present.push_back(robot->shared_machine());
    return present;
  };
  sensor_sources.models = [this] { return machine->model_sensors; };
  sensor_sources.statics = statics;
  sensor_sources.earth = earth;
  sensor_sources.ranges = ranges;
  auto sensors = std::make_unique<SensorTicks>(bus, scene, log, scenario.sensors, std::move(sensor_sources));
  sensor_ticks = sensors.get();
  ticks.add(std::move(sensors));
}

void Twin::Impl::renew_handles() {
  Engine& engine = *machine->engine;
  std::vector<std::string> names;
  std::string root;
  for (const auto& robot : robots) {
    names.push_back(robot->name());
    if (robot->name_space().empty()) root = robot->name();
    robot->rebind(instance_of(engine, robot->machine()));
  }
  scene.show(engine, std::move(names), std::move(root));
  seen_world = engine.compiled();
  ticks.instances_changed();
  ticks.advance_due_times(engine.time());  // sensors that came
}

TwinRobot* Twin::Impl::find(std::string_view name_space) const {
  const auto found =
      std::ranges::find_if(robots, [&](const auto& robot) { return robot->name_space() == name_space; });
  return found == robots.end() ? nullptr : found->get();
}

std::unique_lock<LoopGate> Twin::Impl::hold() {
  return std::unique_lock(gate);
}

TwinRobot* Twin::Impl::find_robot_with_loop() const {
  const auto found = std::ranges::find_if(robots, [](const auto& robot) { return robot->has_loop(); });
  return found == robots.end() ? nullptr : found->get();
}

// The bus's time: that of a robot's ControlLoop, if there is one.
Time Twin::Impl::control_time() const {
  const Time now = machine->engine->time();
  const TwinRobot* const real = find_robot_with_loop();
  return real == nullptr ? now : real->control_time(now);
}

void Twin::Impl::step() {
  // A step starts no loop, so without one no lock is needed.
  const auto held = find_robot_with_loop() ? hold() : std::unique_lock(gate, std::defer_lock);
  notice_instances();
  Engine& engine = *machine->engine;
  const Time now = engine.time();
  follow_wall(now);
  for (const auto& robot : robots) {
    if (!robot->control_due(count)) continue;
    const Stopwatch watch(phases.control);
    robot->tick_control(count, now);
  }
  for (const auto& robot : robots) robot->before_step(count);
  ticks.before_step(now);
  engine.step();
  ++count;
  const Time then = engine.time();
  ticks.after_step(then);
  bool due = ticks.is_due(then);
  for (const auto& robot : robots) {
    robot->after_step(then);
    due = due || robot->publication_due(then);
  }
  hash_objects();
  if (due) publish_due(then);
}

// In the loop. The state of a fixed object is its pose.
void Twin::Impl::hash_objects() {
  for (const int index : scene.objects()) {
    const Instance object = scene.instance(index);
    if (object.v().empty()) {
      const auto matrix = object.root_pose().matrix().topRows<3>().eval();
      objects_hash = mixed(objects_hash, {matrix.data(), static_cast<std::size_t>(matrix.size())});
    } else {
      objects_hash = mixed(mixed(objects_hash, object.q()), object.v());
    }
  }
}

// In the loop. Wall-clock stamps follow the clock, and only decrease if the clock was set back.
void Twin::Impl::follow_wall(Time now) {
  if (bus.sim_time()) return;
  const Time wall = system_time();
  if (wall < last_wall && last_wall - wall < kClockSetBack) return bus.set_stamp_offset(last_wall - now);
  last_wall = wall;
  bus.set_stamp_offset(wall - now);
}

// In the loop.
void Twin::Impl::publish_due(Time now) {
  const Stopwatch watch(phases.publish);
  for (const auto& robot : robots) {
    if (robot->publication_due(now)) robot->publish_due(now);
  }
  if (ticks.is_due(now)) ticks.publish_due(now);
}

void Twin::Impl::publish_state() {
  const auto held = hold();
  const Time now = machine->engine->time();
  bus.set_now(now);
  follow_wall(now);
  ticks.show(now);
  for (const auto& robot : robots) robot->show(now);
}

void Twin::Impl::between_steps() {
  const auto held = hold();
  bus.set_now(control_time());
  follow_wall(machine->engine->time());
  settle_divergence();
  for (const auto& robot : robots) robot->settle(machine->engine->time());
  bus.spin();
  settle_divergence();
  notice_instances();
  const Time now = machine->engine->time();  // a request may have set it back
  for (const auto& robot : robots) robot->between_steps(now);
  ticks.between_steps(now);
}

std::string Twin::Impl::divergence_text() const {
  const std::string motion = fastest_motion(*machine->engine), loads = time_services->loads_text();
  std::string out = fmt::format("the physics diverged in step {} (t = {:.3f} s)", count,
                                to_seconds(machine->engine->time()));
  if (!motion.empty()) out += ": " + motion;
  if (!loads.empty()) out += "; " + loads;
  return out;
}

void Twin::Impl::settle_divergence() {
  if (!machine->engine->diverged()) {
    if (edited && machine->engine->time() - edited->applied > kEditProbation) edited.reset();
    if (time_control.divergence.empty()) return;
    time_control.divergence.clear();
    if (std::exchange(paused_by_divergence, false)) time_control.paused = false;
    log.note("physics", fmt::format("the simulation can continue from t = {:.3f} s",
                                    to_seconds(machine->engine->time())));
    return;
  }
  if (!time_control.divergence.empty()) return;  // reported
  const std::string cause = divergence_text();
  if (take_back_edit(cause) || !time_control.pauses_at_divergence) return;
  time_control.divergence = cause;
  time_control.steps_owed = 0;
  paused_by_divergence = !std::exchange(time_control.paused, true);
  log.error("physics",
            cause + "; time is paused at the last finite state, and /gazebo/reset_simulation continues");
  publish_state();
}

void Twin::Impl::reset(std::optional<Time> at) {
  const auto held = hold();
  Engine& engine = *machine->engine;
  edited.reset();  // its time is another one from now on
  engine.reset();
  if (at) engine.set_time(*at);
  const Time now = engine.time();
  bus.set_now(now);
  follow_wall(now);
  ticks.reset(now);
  for (const auto& robot : robots) robot->reset(now);
  publish_state();
  all_due_now();
}

Twin::Twin(const Scenario& scenario, const Log& log, Diagnostics& diagnostics)
    : impl_(std::make_unique<Impl>(*this, scenario, log, diagnostics)) {}

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
std::unique_lock<LoopGate> Twin::hold() {
  return impl_->hold();
}
const LoopPhases& Twin::step_phases() const {
  return impl_->phases;
}

std::vector<std::filesystem::path> Twin::files() const {
  return impl_->machine->files();
}

Time Twin::now() const {
  return impl_->machine->engine->time();
}
std::uint64_t Twin::steps() const {
  return impl_->count;
}
std::uint64_t Twin::state_hash() const {
  std::uint64_t hash = mixed(impl_->gone_hash, impl_->objects_hash);
  for (const auto& robot : impl_->robots) hash = mixed(hash, robot->state_hash());
  return hash;
}
std::vector<RigStatus> Twin::sensors() const {
  return impl_->sensor_ticks->status();
}
bool Twin::diverged() const {
  return impl_->machine->engine->diverged();
}
std::string Twin::name() const {
  std::string out;
  for (const auto& robot : impl_->robots) out += (out.empty() ? "" : ", ") + robot->name();
  return out.empty() ? impl_->machine->world.name : out;
}
const std::vector<std::unique_ptr<TwinRobot>>& Twin::robots() const {
  return impl_->robots;
}
TwinRobot* Twin::find_robot(std::string_view name_space) const {
  return impl_->find(name_space);
}
Engine& Twin::engine() {
  return *impl_->machine->engine;
}
const Engine& Twin::engine() const {
  return *impl_->machine->engine;
}
Bus& Twin::bus() {
  return impl_->bus;
}
TimeControl& Twin::time_control() {
  return impl_->time_control;
}
Duration Twin::step_size() const {
  return impl_->machine->world.step;
}

}  // namespace doppel
