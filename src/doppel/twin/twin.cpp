#include "doppel/twin/twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "doppel/messages/rcl_interfaces.h"
#include "doppel/twin/robot_setup.h"
#include "doppel/twin/simulated_hardware.h"
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

BaseKind base_of(const RobotDescription& robot, const Scenario& scenario, Diagnostics& diagnostics) {
  std::string root;
  for (const Link& link : robot.links) {
    const auto child = [&](const Joint& joint) { return joint.child == link.name; };
    if (std::none_of(robot.joints.begin(), robot.joints.end(), child)) root = link.name;
  }
  if (root == "world") return BaseKind::fixed;
  if (scenario.base == BaseKind::fixed) {
    diagnostics.note("up.base_fixed", robot.source,
                     fmt::format("the root link '{}' is fixed to the world (there is no link 'world')", root),
                     "--base floating lets it fall and move");
  }
  return scenario.base;
}

std::vector<HardwareDescription> hardware_of(const RobotSetup& setup, const Model& model,
                                             Diagnostics& diagnostics) {
  const RobotDescription& robot = setup.description.robot;
  bool position = false;
  for (const auto& hardware : robot.hardware) {
    for (const auto& joint : hardware.joints) {
      for (const auto& interface : joint.command_interfaces)
        position = position || interface.name == kPosition;
    }
  }
  if (robot.hardware.empty() || (setup.controllers_origin == "generated" && !position)) {
    diagnostics.note(
        "up.hardware_generated", robot.source,
        robot.hardware.empty()
            ? "there is no <ros2_control>; every joint that can be driven gets simulated interfaces"
            : "no joint under <ros2_control> takes position commands; every joint that can be driven gets "
              "simulated interfaces instead");
    return {generated_hardware(model)};
  }
  for (const auto& hardware : robot.hardware) report_plugin(hardware, diagnostics);
  return robot.hardware;
}

}  // namespace

struct Twin::Impl {
  Impl(const Scenario& scenario, const Log& the_log, Diagnostics& diagnostics)
      : log(the_log), setup(set_up_robot(scenario, resolver, diagnostics)) {
    const RobotDescription& robot = setup.description.robot;
    model = compile_model(robot, base_of(robot, scenario, diagnostics), diagnostics);
    build_engine(scenario, diagnostics);
    build_control(scenario, diagnostics);
    diagnostics.throw_if_errors();

    publisher = std::make_unique<StatePublisher>(bus, robot, model);
    services = std::make_unique<SimulatorServices>(
        bus, model, *engine,
        SimulatorServices::Callbacks{[this] { reset(); }, [this] { manager->restart(engine->time()); }});
    publisher->publish_latched(Time{});
    const Duration step = setup.world.step;
    steps_per_tick = static_cast<std::uint64_t>(manager->steps_per_tick());
    steps_per_transforms = steps_in(kTransformPeriod, step);
    steps_per_clock = steps_in(kClockPeriod, step);
    steps_per_housekeeping = steps_in(kHousekeepingPeriod, step);
    if (scenario.start_controllers) start_controllers(scenario);
    next_tick = next_transforms = next_clock = next_housekeeping = 0;
  }

  void build_engine(const Scenario& scenario, Diagnostics& diagnostics) {
    EngineOptions options;
    options.q0 = model.neutral();
    apply_initial_values(setup.description.robot, model, options.q0, diagnostics);
    options.servos = choose_servos(model, ServoOptions{.ideal = scenario.ideal}, gravity_R());
    servos = options.servos;
    engine = make_mujoco_engine(setup.description.robot, model, setup.world, options, diagnostics);
  }

  // Gravity in the axes of the robot's root link.
  [[nodiscard]] Eigen::Vector3d gravity_R() const {
    return setup.world.X_WR.linear().transpose() * setup.world.gravity;
  }

  void build_control(const Scenario& scenario, Diagnostics& diagnostics) {
    registry = ControllerRegistry::with_builtin();
    for (const std::string& plugin : scenario.plugins) registry.load_library(plugin);
    ControllerManagerOptions options;
    options.physics_step = setup.world.step;
    options.enforce_limits = scenario.enforce_limits;
    manager = std::make_unique<ControllerManager>(bus, model, registry, &setup.controllers, options, log,
                                                  diagnostics);
    for (const HardwareDescription& hardware : hardware_of(setup, model, diagnostics)) {
      manager->add_hardware(std::make_unique<SimulatedHardware>(hardware, model, *engine, diagnostics));
    }
  }

  void start_controllers(const Scenario& scenario) {
    std::vector<std::string> names = scenario.activate;
    std::vector<std::string> rest;
    for (const auto& [name, type] : manager->declared_controllers()) {
      if (scenario.activate.empty()) {
        names.push_back(name);
      } else if (std::find(names.begin(), names.end(), name) == names.end()) {
        rest.push_back(name);
      }
    }
    manager->start(names);
    for (const std::string& name : rest) {
      manager->load(name);
      if (const Status configured = manager->configure(name); !configured)
        log.warning(name, configured.why());
    }
  }

  void step() {
    const Time now = engine->time();
    if (count == next_tick) {
      manager->tick(now);
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
      publisher->publish_transforms(engine->time(), Eigen::Map<const Eigen::VectorXd>(q.data(), model.nq));
      next_transforms += steps_per_transforms;
    }
    if (count >= next_clock) {
      publisher->publish_clock(engine->time());
      next_clock += steps_per_clock;
    }
  }

  void between_steps() {
    bus.set_now(engine->time());
    bus.spin();
    if (count >= next_housekeeping) {
      manager->housekeeping(engine->time());
      next_housekeeping = count + steps_per_housekeeping;
    }
  }

  void reset() {
    engine->reset();
    services->forget_loads();
    bus.set_now(engine->time());
    manager->restart(engine->time());
    publisher->publish_latched(engine->time());
    next_tick = next_transforms = next_clock = next_housekeeping = count;
  }

  const Log& log;
  PackageResolver resolver;
  RobotSetup setup;
  Model model;
  std::vector<ServoParameters> servos;
  Bus bus;
  std::unique_ptr<Engine> engine;
  ControllerRegistry registry;
  std::unique_ptr<ControllerManager> manager;
  std::unique_ptr<StatePublisher> publisher;
  std::unique_ptr<SimulatorServices> services;

  std::uint64_t count = 0, hash = 0xCBF29CE484222325ull;
  std::uint64_t steps_per_tick = 1, steps_per_transforms = 1, steps_per_clock = 1, steps_per_housekeeping = 1;
  std::uint64_t next_tick = 0, next_transforms = 0, next_clock = 0, next_housekeeping = 0;
};

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
Time Twin::now() const {
  return impl_->engine->time();
}
std::uint64_t Twin::steps() const {
  return impl_->count;
}
std::uint64_t Twin::state_hash() const {
  return impl_->hash;
}
bool Twin::diverged() const {
  return impl_->engine->diverged();
}
const std::string& Twin::robot_name() const {
  return impl_->model.name;
}
const std::string& Twin::controllers_origin() const {
  return impl_->setup.controllers_origin;
}
const Model& Twin::model() const {
  return impl_->model;
}
const RobotDescription& Twin::description() const {
  return impl_->setup.description.robot;
}
Engine& Twin::engine() {
  return *impl_->engine;
}
ControllerManager& Twin::controller_manager() {
  return *impl_->manager;
}
Bus& Twin::bus() {
  return impl_->bus;
}
TimeControl& Twin::time_control() {
  return impl_->services->time_control();
}
Duration Twin::step_size() const {
  return impl_->setup.world.step;
}

std::vector<JointSnapshot> Twin::joints() const {
  std::vector<std::pair<std::string_view, double>> targets;
  impl_->manager->targets(targets);
  std::vector<JointSnapshot> out;
  const Engine& engine = *impl_->engine;
  for (std::size_t j = 0; j < impl_->model.joints.size(); ++j) {
    const ModelJoint& joint = impl_->model.joints[j];
    if (!joint.scalar()) continue;
    JointSnapshot snapshot;
    snapshot.name = joint.name;
    snapshot.q = engine.q()[static_cast<std::size_t>(joint.q)];
    snapshot.v = engine.v()[static_cast<std::size_t>(joint.v)];
    snapshot.tau = engine.drive_effort()[j];
    snapshot.target = std::nan("");
    for (const auto& [name, target] : targets) {
      if (name == joint.name) snapshot.target = target;
      if (joint.mimics() && name == impl_->model.joints[static_cast<std::size_t>(joint.mimic_leader)].name) {
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
  Data data(impl_->model);
  const auto q = impl_->engine->q();
  const Eigen::Map<const Eigen::VectorXd> configuration(q.data(), impl_->model.nq);
  std::vector<SagReport> out;
  for (const Sag& sag : static_sag(impl_->model, data, impl_->servos, configuration, impl_->gravity_R())) {
    out.push_back(
        {impl_->model.joints[static_cast<std::size_t>(sag.joint)].name, sag.torque, sag.sag, sag.margin});
  }
  return out;
}

}  // namespace doppel
