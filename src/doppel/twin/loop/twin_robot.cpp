#include "doppel/twin/loop/twin_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "doppel/control/manager/joint_list.h"
#include "doppel/robot/kinematics/link_masses.h"
#include "doppel/twin/loop/detail/ground_truth.h"
#include "doppel/twin/loop/detail/load_publisher.h"
#include "doppel/twin/loop/detail/oscillation_watch.h"
#include "doppel/twin/loop/detail/shadow.h"
#include "doppel/twin/loop/detail/state_hash.h"

namespace doppel {
namespace {

constexpr const char* kRestOrigin = "physics";
constexpr std::size_t kMaxUnsettledShown = 5;
constexpr Duration kHousekeepingPeriod{5'000'000};  // controllers choose slower rates of their own

class Transforms : public Tickable {
 public:
  Transforms(const TwinRobot& robot, std::unique_ptr<StatePublisher> publisher, Time now)
      : robot_(robot), publisher_(std::move(publisher)) {
    reset(now);
  }

  Time publish(Time now) override {
    show(now);
    return pace_.next(now, period());
  }
  [[nodiscard]] Time next_after(Time now) const override { return now + period(); }
  void show(Time now) override {
    const auto q = robot_.present_q();
    publisher_->publish_transforms(now, Eigen::Map<const Eigen::VectorXd>(q.data(), robot_.model().nq));
  }
  void reset(Time now) override {
    pace_.restart(now);
    publisher_->publish_latched(now);
  }
  void robots_changed(Time now) override { publisher_->publish_latched(now); }
  void save(SavedSlot& slot) override { save_run(pace_, slot); }
  void restore(const SavedPart* saved, Time /*now*/) override {
    if (saved != nullptr) restore_run(*saved, pace_);
  }
  void between_steps(Time now) override {
    publisher_->follow_base_transform(robot_.controller_manager().base_transform(), now);
  }

 private:
  [[nodiscard]] Duration period() const {
    return whole_steps(publisher_->period(), robot_.instance().engine().world().settings().step);
  }

  const TwinRobot& robot_;
  std::unique_ptr<StatePublisher> publisher_;
  Pace pace_;
};

class LoadMonitor : public Tickable {
 public:
  LoadMonitor(const TwinRobot& robot, Bus& bus) : robot_(robot), publisher_(bus, robot.shared_machine()) {}

  void between_steps(Time now) override { publisher_.publish_due(robot_.instance(), now); }
  void show(Time /*now*/) override { publisher_.at_once(); }

 private:
  const TwinRobot& robot_;
  LoadPublisher publisher_;
};

// The position that a controller follows for each joint, without allocation.
FollowedPosition followed_by_controllers(const TwinRobot& robot) {
  std::vector<std::string> interfaces;
  for (const ModelJoint& joint : robot.model().joints) interfaces.push_back(joint.name + "/" + kPosition);
  return [&robot, interfaces = std::move(interfaces)](int joint) {
    return robot.controller_manager().reference(interfaces[static_cast<std::size_t>(joint)]);
  };
}

// Reports each joint once, by its name and a message.
class OscillationMonitor : public Tickable {
 public:
  using Report = std::function<void(const std::string&, std::string)>;
  OscillationMonitor(const TwinRobot& robot, Report report)
      : robot_(robot),
        watch_(robot.machine().shared_model(), followed_by_controllers(robot)),
        report_(std::move(report)) {}

  [[nodiscard]] bool at_every_step() const override { return true; }
  void after_step(Time now) override { watch_.look(robot_.instance(), now); }
  void save(SavedSlot& slot) override { save_run(watch_.run(), slot); }
  void restore(const SavedPart* saved, Time /*now*/) override {
    if (const auto* before = value_of<OscillationWatch::Run>(saved)) watch_.set_run(*before);
  }
  void between_steps(Time /*now*/) override {
    if (!watch_.found()) return;
    for (const Oscillation& found : watch_.take()) {
      report_(robot_.model().joints[static_cast<std::size_t>(found.joint)].name,
              to_string(found, robot_.instance()));
    }
  }

 private:
  const TwinRobot& robot_;
  OscillationWatch watch_;
  const Report report_;
};

class RestMonitor : public Tickable {
 public:
  RestMonitor(const TwinRobot& robot, RestCheck& check, std::function<void()> report)
      : robot_(robot), check_(check), followed_(followed_by_controllers(robot)), report_(std::move(report)) {}

  void between_steps(Time /*now*/) override {
    if (check_.look(robot_.description(), robot_.instance(), followed_)) report_();
  }

 private:
  const TwinRobot& robot_;
  RestCheck& check_;
  const FollowedPosition followed_;
  const std::function<void()> report_;
};

}  // namespace

TwinRobot::TwinRobot(const Surroundings& around, std::shared_ptr<const CompiledRobot> machine,
                     Instance instance, const TwinRobot* former, Diagnostics& diagnostics)
    : around_(around),
      machine_(std::move(machine)),
      instance_(instance),
      history_(former != nullptr ? former->history_ : History{RestCheck(instance), {}, kEmptyHash}) {
  // With several robots a log line names the robot by its namespace, because their controllers have equal
  // names.
  own_log_.add_sink([&log = around_.log, name_space = name_space()](const LogLine& line) {
    log.line(line.severity, name_space + "/" + line.origin, line.text);
  });
  ControlStack::Options options{around.controllers, around.hardware, around.scenario.enforce_limits,
                                around.scenario.hardware};
  options.emulation = around.scenario.emulation;
  options.guard = around.scenario.guard;
  options.keep_out = around.keep_out;
  options.rehearses = around.scenario.mirror == MirrorMode::rehearse;
  options.present_q = [this] { return present_q(); };
  options.sensors = around.scenario.sensors;
  options.earth = around.earth;
  options.ranges = around.ranges;
  options.must_start = former == nullptr;
  if (former != nullptr) options.former = former->control_.get();
  control_ = std::make_unique<ControlStack>(around.bus, *machine_, instance_, options, log(), diagnostics);
  // The manager's period is a whole number of steps (see period_in_steps()), so that the division is exact.
  steps_per_tick_ = static_cast<std::uint64_t>(control_->manager().period() / step());
  if (control_->has_real_hardware())
    shadow_ = std::make_unique<Shadow>(control_->manager(), machine_->model(), around_.scenario.mirror);
  report_unbound();
}

TwinRobot::~TwinRobot() {
  loop_.reset();  // ends the loop's thread before the members that it uses are destroyed
}

TickList TwinRobot::make_publishers() {
  StatePublisher::Options options;
  options.name_space = name_space();
  options.tf = machine_->asked().tf;
  options.X_WR = machine_->instance().X_WR;
  options.file = &machine_->setup().controllers;
  options.frames = machine_->sensors().frames;
  options.statics = around_.statics;
  TickList fresh;
  fresh.add(std::make_unique<Transforms>(
      *this, std::make_unique<StatePublisher>(around_.bus, description(), machine_->shared_model(), options),
      instance_.engine().time()));
  fresh.add(
      std::make_unique<OscillationMonitor>(*this, [this](const std::string& joint, std::string message) {
        report_oscillation(joint, std::move(message));
      }));
  if (around_.scenario.start_controllers)
    fresh.add(std::make_unique<RestMonitor>(*this, history_.rest, [this] { report_rest(); }));
  fresh.add(std::make_unique<LoadMonitor>(*this, around_.bus));
  if (machine_->instance().floating()) {
    fresh.add(std::make_unique<GroundTruth>(
        around_.bus, *machine_, [this]() -> const Instance& { return instance_; },
        instance_.engine().time()));
  }
  // The former publishers are returned and not destroyed: a reload that fails afterwards puts them back.
  return std::exchange(ticks_, std::move(fresh));
}

void TwinRobot::start_first() {
  if (around_.scenario.start_controllers) start(control_->selection_of(*machine_));
}

void TwinRobot::start_loop() {
  // Simulated hardware is read and written in the step itself; real hardware needs a thread at its own
  // rate.
  if (!control_->has_real_hardware()) return;
  const LoopSettings settings = control_->manager().loop_settings();
  loop_ = std::make_unique<ControlLoop>(
      control_->manager(), around_.gate, instance_.engine().time(),
      ControlLoopOptions{settings.thread_priority, settings.lock_memory, Duration{}}, log());
}

void TwinRobot::take_over(std::shared_ptr<const CompiledRobot> machine, Instance now) {
  control_->take_over(*machine, now);
  report_unbound();
  machine_ = std::move(machine);
  instance_ = now;
}

void TwinRobot::rebind(Instance instance) {
  instance_ = instance;
  control_->rebind(instance);
  ticks_.instances_changed();
}

void TwinRobot::between_steps(Time now) {
  // Housekeeping publishes what may allocate, such as a controller's state, and is therefore outside the
  // tick.
  if (now >= next_housekeeping_) {
    control_->manager().housekeeping(control_time(now));
    next_housekeeping_ = now + kHousekeepingPeriod;
    control_->attend(log());
    ticks_.advance_due_times(now);  // a higher rate takes effect at once
  }
  ticks_.between_steps(now);
}

void TwinRobot::reset(Time now) {
  control_->restart_sensors();
  control_->manager().restart(control_time(now));
  ticks_.reset(now);
  next_housekeeping_ = now;
}

Status TwinRobot::save(Saved& out) {
  out.rest = history_.rest;
  out.oscillations = history_.oscillations;
  out.hash = history_.hash;
  out.next_tick = next_tick_;
  out.next_housekeeping = next_housekeeping_;
  ticks_.save(out.ticks);
  return control_->manager().save(out.manager);
}

void TwinRobot::restore_values(const Saved& saved, Time now) {
  if (saved.rest) history_.rest = *saved.rest;
  history_.oscillations = saved.oscillations;
  history_.hash = saved.hash;
  next_tick_ = saved.next_tick;
  next_housekeeping_ = saved.next_housekeeping;
  control_->manager().restore_values(*saved.manager, now);
  ticks_.restore(saved.ticks, now);
}

void TwinRobot::show(Time now) {
  ticks_.show(now);
  control_->manager().publish_state(control_time(now));
}

void TwinRobot::before_step(std::uint64_t step) {
  if (loop_ || control_due(step + 1)) control_->before_step();
  if (shadow_) shadow_->before_step(instance_);
}

std::span<const double> TwinRobot::present_q() const {
  return shadow_ ? shadow_->measured_q(instance_) : instance_.q();
}

bool TwinRobot::is_measured(int joint) const {
  return shadow_ && shadow_->is_measured(joint);
}

bool TwinRobot::is_shadow() const {
  return shadow_ && shadow_->is_commanded();
}

void TwinRobot::after_step(Time now) {
  if (!loop_) control_->after_step();
  ticks_.after_step(now);
  // The efforts are part of the hash, because a drive that pushes against a stop changes no position.
  history_.hash = mixed(mixed(mixed(history_.hash, instance_.q()), instance_.v()), instance_.drive_effort());
}

std::string TwinRobot::controllers_origin() const {
  const RobotSetup& setup = machine_->setup();
  const bool beside = !setup.controllers_files.empty() && control_->has_generated();
  return setup.controllers_origin + (beside ? " and generated" : "");
}

RobotChoices TwinRobot::choices() const {
  const RobotSetup& setup = machine_->setup();
  RobotChoices out;
  out.controllers = setup.controllers_files;
  out.parameters = setup.generated;
  if (control_->has_generated()) out.parameters.push_back(control_->generated_yaml());
  for (const ControllerView& controller : controller_manager().controllers())
    (controller.state == ControllerState::active ? out.active : out.inactive).push_back(controller.name);
  out.generated_hardware = machine_->has_generated_hardware();
  out.masses = masses_not_written(description(), model());
  return out;
}

std::vector<JointSnapshot> TwinRobot::joints() const {
  const ControllerManager& manager = control_->manager();
  // The desired position: a position command, or the reference of a controller with
  // another command interface.
  const auto target_of = [&manager](const ModelJoint& of) {
    const std::string position = of.name + "/" + kPosition;
    const double command = manager.command(position);
    return std::isfinite(command) ? command : manager.reference(position);
  };
  const auto q = present_q();
  std::vector<JointSnapshot> out;
  for (std::size_t j = 0; j < model().joints.size(); ++j) {
    const ModelJoint& joint = model().joints[j];
    if (!joint.scalar()) continue;
    JointSnapshot snapshot;
    snapshot.name = joint.name;
    snapshot.q = q[static_cast<std::size_t>(joint.q)];
    snapshot.v = instance_.v()[static_cast<std::size_t>(joint.v)];
    snapshot.tau = instance_.drive_effort()[j];
    snapshot.target = joint.mimics()
                          ? joint.mimic_multiplier *
                                    target_of(model().joints[static_cast<std::size_t>(joint.mimic_leader)]) +
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

std::vector<SagReport> TwinRobot::gravity_sag() const {
  Data data(model());
  const Eigen::Map<const Eigen::VectorXd> q(instance_.q().data(), model().nq);
  StaticSag found;
  // Each joint is loaded by what it carries at the present q, at rest: the sag is that torque over the
  // drive's stiffness.
  static_sag(model(), data, machine_->servos(), q, machine_->gravity_R(), found);
  std::vector<SagReport> out;
  for (const Sag& sag : found.sags) {
    // Only a drive that holds a position sags: an effort has no stiffness, and a passive joint none either.
    if (instance_.drive(sag.joint) != DriveMode::position) continue;
    out.push_back({model().joints[static_cast<std::size_t>(sag.joint)].name, sag.torque, sag.sag, sag.least,
                   sag.most, sag.margin});
  }
  return out;
}

std::set<std::string> TwinRobot::overloaded_joints() const {
  std::set<std::string> out;
  for (const SagReport& sag : gravity_sag()) {
    if (sag.margin < 0) out.insert(sag.joint);
  }
  return out;
}

// The start's check of efforts, after an edit.
void TwinRobot::report_overloads(const std::set<std::string>& known) {
  for (const SagReport& sag : gravity_sag()) {
    if (sag.margin >= 0 || known.contains(sag.joint)) continue;
    const Joint* const joint = description().find_joint(sag.joint);
    const bool slides = joint != nullptr && joint->type == JointType::prismatic;
    const int index = model().find_joint(sag.joint);
    log_diagnostic(
        log(), kRestOrigin,
        {Severity::warning, "reload.overload",
         fmt::format("after the edit, the effort limit {:.3g} {} of '{}' is below its load of {:.3g} {}: its "
                     "drive cannot hold it",
                     machine_->servos()[static_cast<std::size_t>(index)].effort, slides ? "N" : "N m",
                     sag.joint, std::abs(sag.torque), slides ? "N" : "N m"),
         joint == nullptr ? SourceLocation{}
         : joint->limits  ? joint->limits->source
                          : joint->source,
         "raise `effort` in its <limit>, or reduce the masses that it carries"});
  }
}

// A warning that an edit leaves as it was is not repeated, wherever it is now in the file.
void TwinRobot::report_unbound() {
  std::set<std::string> present;
  for (const auto& [component, finding] : control_->unbound()) {
    const std::string text = component + ": " + finding.message;
    if (present.insert(text).second && !history_.unbound.contains(text))
      log_diagnostic(log(), component, finding);
  }
  history_.unbound = std::move(present);
}

std::string TwinRobot::rest_reason() const {
  if (history_.rest.was_commanded()) return "the robot was commanded before it was checked";
  if (!rest()) return "it is not checked yet";
  if (!around_.scenario.start_controllers)
    return fmt::format("no controllers were to start; this is the state after {:g} s",
                       to_seconds(rest()->time - history_.rest.begin()));
  if (rest()->time < history_.rest.begin() + kRestTime)
    return fmt::format("the run ended {:g} s after the start, before the check at {:g} s",
                       to_seconds(rest()->time - history_.rest.begin()), to_seconds(kRestTime));
  return "";
}

void TwinRobot::conclude_rest() {
  history_.rest.conclude(description(), instance_, followed_by_controllers(*this));
}

void TwinRobot::report_rest() {
  if (!rest()) return;
  const RestReport& report = *rest();
  for (std::size_t i = 0; i < std::min(report.unsettled.size(), kMaxUnsettledShown); ++i) {
    log().warning(kRestOrigin, fmt::format("not at rest {:g} s after the start, without commands: {}",
                                           to_seconds(kRestTime), report.unsettled[i]));
  }
  if (report.unsettled.size() > kMaxUnsettledShown)
    log().warning(kRestOrigin,
                  fmt::format("... and {} more joints", report.unsettled.size() - kMaxUnsettledShown));
  if (!report.base.empty() && !report.base_touches) {
    log().warning(kRestOrigin, report.base + " (--base fixed holds it)");
  } else if (!report.base.empty() && report.unsettled.empty()) {
    log().note(kRestOrigin, report.base + " (--base fixed holds it)");
  }
}

void TwinRobot::report_oscillation(const std::string& joint, std::string message) {
  history_.oscillations.push_back({joint, std::move(message)});
  log().warning(kRestOrigin, history_.oscillations.back().message);
}

}  // namespace doppel
