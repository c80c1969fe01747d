#include "doppel/twin/assembly/twin.h"

#include <utility>

#include "doppel/ros/messages/distro.h"
#include "doppel/twin/arms/arms.h"
#include "doppel/twin/attachments/attachments.h"
#include "doppel/twin/journal/input_journal.h"
#include "doppel/twin/loop/twin_core.h"
#include "doppel/twin/mirror/mirror.h"
#include "doppel/twin/publishers/publishers.h"
#include "doppel/twin/reload/twin_reload.h"
#include "doppel/twin/saved_states/saved_states.h"
#include "doppel/twin/sensor_ticks/sensor_ticks.h"
#include "doppel/twin/services/services.h"

namespace doppel {
namespace {

// Before the first message and the first controller of the twin are made.
const Scenario& with_its_distro(const Scenario& scenario) {
  if (scenario.distro) set_ros_distro(*scenario.distro);
  return scenario;
}

}  // namespace

struct Twin::Impl {
  Impl(const Scenario& scenario, const Log& log, Diagnostics& diagnostics)
      : core(with_its_distro(scenario), log, diagnostics) {
    // The order is that of their calls within a step.
    add_services(core);
    add_publishers(core);
    add_attachments(core);
    add_arms(core);
    sensors = add<SensorTicks>();
    add_mirror(core);
    reload = add<TwinReload>();
    add<InputJournal>();
    states = add<SavedStates>();  // last: it saves what the others have done between two steps
    core.start();
  }

  template <class Part>
  Part* add() {
    auto part = std::make_unique<Part>(core);
    Part* const out = part.get();
    core.add(std::move(part));
    return out;
  }

  TwinCore core;
  SensorTicks* sensors = nullptr;  // these belong to the core
  TwinReload* reload = nullptr;
  SavedStates* states = nullptr;
};

Twin::Twin(const Scenario& scenario, const Log& log, Diagnostics& diagnostics)
    : impl_(std::make_unique<Impl>(scenario, log, diagnostics)) {}

Twin::~Twin() = default;

void Twin::step() {
  impl_->core.step();
}
void Twin::between_steps() {
  impl_->core.between_steps();
}
void Twin::reset() {
  impl_->core.reset();
}
std::shared_ptr<const SavedState> Twin::save() {
  return impl_->states->save_now();
}
Status Twin::restore(const SavedState& state) {
  return impl_->states->restore_state(state);
}
void Twin::keep_states(bool on) {
  impl_->states->keep(on);
}
Status Twin::rewind(Duration back) {
  std::string done;
  return impl_->states->rewind(back, done);
}
void Twin::publish_state() {
  impl_->core.publish_state();
}
std::unique_lock<LoopGate> Twin::hold() {
  return impl_->core.hold();
}
const LoopPhases& Twin::step_phases() const {
  return impl_->core.phases();
}

std::shared_ptr<const Twin::Running> Twin::running() const {
  return impl_->core.running();
}
std::shared_ptr<JoiningRobot> Twin::prepare_robot(const std::shared_ptr<const Running>& running,
                                                  const WorldRobot& robot, const SpawnedText& text,
                                                  Diagnostics& diagnostics) {
  return doppel::prepare_robot(*running, robot, text, diagnostics);
}
void Twin::add_robot(const std::shared_ptr<JoiningRobot>& joining) {
  impl_->core.add_robot(*joining);
}
Status Twin::remove_robot(const std::string& name_space) {
  return impl_->core.remove_robot(name_space);
}
void Twin::on_robots_changed(std::function<void()> callback) {
  impl_->core.on_robots_changed(std::move(callback));
}

Scenario Twin::complete_scenario() const {
  Scenario out = impl_->core.scenario();
  out.complete = true;
  out.distro = ros_distro();
  out.step = step_size();
  out.robots.clear();
  out.choices.clear();
  for (const auto& robot : robots()) {
    // A model of an SDF world is a robot by what its file has written.
    if (robot->machine().asked().target.empty()) continue;
    WorldRobot& chosen = out.robots.emplace_back(robot->machine().asked());
    chosen.arguments = robot->machine().setup().arguments;
    chosen.base = robot->machine().base();
    chosen.controllers.clear();
    chosen.tolerant = false;
    chosen.activate.clear();
    out.choices[chosen.name_space] = robot->choices();
  }
  return out;
}

std::shared_ptr<Twin::Replacement> Twin::prepare(const std::shared_ptr<const Running>& running,
                                                 Diagnostics& diagnostics) {
  return prepare_replacement(running, diagnostics);
}
Twin::Reload Twin::replace(const std::shared_ptr<Replacement>& replacement) {
  return impl_->reload->replace(*replacement) ? Reload::controllers_kept : Reload::controllers_recreated;
}
std::vector<ModelInstance> Twin::instances(const Replacement& replacement) {
  return replacement.machine->engine->world().instances();
}
const std::vector<std::shared_ptr<const CompiledRobot>>& Twin::robots(const Replacement& replacement) {
  return replacement.machine->robots;
}
std::vector<std::filesystem::path> Twin::files(const Replacement& replacement) {
  return replacement.machine->files();
}
std::vector<ExpandedDescription> Twin::expand(const Running& running) {
  std::vector<ExpandedDescription> out;
  for (const auto& robot : running.robots.now) {
    if (robot->asked().target.empty()) continue;
    auto description = expanded_if_possible(running.sources->scenario, robot->asked());
    if (description) out.push_back(std::move(*description));
  }
  return out;
}
std::vector<std::filesystem::path> Twin::files() const {
  return impl_->core.machine().files();
}

Time Twin::now() const {
  return impl_->core.now();
}
std::uint64_t Twin::steps_taken() const {
  return impl_->core.steps_taken();
}
std::uint64_t Twin::steps() const {
  return impl_->core.steps();
}
std::uint64_t Twin::state_hash() const {
  return impl_->core.state_hash();
}
std::vector<RigStatus> Twin::sensors() const {
  return impl_->sensors->status();
}
bool Twin::diverged() const {
  return impl_->core.engine().diverged();
}
std::string Twin::name() const {
  std::string out;
  for (const auto& robot : impl_->core.robots()) out += (out.empty() ? "" : ", ") + robot->name();
  return out.empty() ? impl_->core.machine().world.name : out;
}
const std::vector<std::unique_ptr<TwinRobot>>& Twin::robots() const {
  return impl_->core.robots();
}
TwinRobot* Twin::find_robot(std::string_view name_space) const {
  return impl_->core.find(name_space);
}
Engine& Twin::engine() {
  return impl_->core.engine();
}
const Engine& Twin::engine() const {
  return impl_->core.engine();
}
Bus& Twin::bus() {
  return impl_->core.bus();
}
TimeControl& Twin::time_control() {
  return impl_->core.time_control();
}
Duration Twin::step_size() const {
  return impl_->core.machine().world.step;
}

}  // namespace doppel
