#include "python/stepped_twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "doppel/base/core/installation.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/version.h"

namespace doppel::python {
namespace {

constexpr std::size_t kMaxLogLines = 1000;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

[[noreturn]] void refuse_removed(const RobotArrays& arrays) {
  throw InputError("python.robot_removed", {}, fmt::format("the robot '{}' was removed", arrays.name_space),
                   "make a new Twin, which has the robots of its start, or do not delete this one");
}

const std::string& joint_name(const TwinRobot& robot, int joint) {
  return robot.model().joints[static_cast<std::size_t>(joint)].name;
}

// Empty: no controller commands the joint.
std::string controller_of(const TwinRobot& robot, const std::string& joint) {
  for (const InterfaceView& interface : robot.controller_manager().command_interfaces()) {
    if (interface.full_name.starts_with(joint + "/") && !interface.claimed_by.empty())
      return interface.claimed_by;
  }
  return "";
}

Diagnostic claimed(const std::string& controller, const std::vector<std::string>& joints) {
  return {
      Severity::error,
      "python.claimed",
      fmt::format("command of '{}' is refused, because the controller '{}' commands {}; it has its former "
                  "value again (NaN: none)",
                  fmt::join(joints, "', '"), controller, joints.size() == 1 ? "this joint" : "these joints"),
      {},
      fmt::format("send the command to twin.controller(\"{}\"), or start the twin with controllers=False",
                  controller)};
}

}  // namespace

RobotArrays::RobotArrays(const TwinRobot& robot)
    : name_space(robot.name_space()), machine(robot.shared_machine()) {
  const Model& model = robot.model();
  q.resize(static_cast<std::size_t>(model.nq));
  v.resize(static_cast<std::size_t>(model.nv));
  effort.resize(v.size());
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    if (model.joints[i].scalar() && !model.joints[i].mimics()) driven.push_back(static_cast<int>(i));
  }
  command.assign(driven.size(), kNone);
  applied = command;
}

SteppedTwin::SteppedTwin(const Scenario& scenario) {
  log_.add_sink([this](const LogLine& line) {
    const std::lock_guard lock(lines_mutex_);
    lines_.push_back(line);
    if (lines_.size() > kMaxLogLines) lines_.pop_front();
  });
  Diagnostics diagnostics;
  twin_ = std::make_unique<Twin>(scenario, log_, diagnostics);
  diagnostics_ = diagnostics.all();
  for (const auto& robot : twin().robots()) robots_.emplace_back(*robot);
  edge_ = twin().bus().attach("python", {.receives_own = false, .listed = false});
  copy_state();
}

SteppedTwin::~SteppedTwin() {
  close();
}

// The recorder and the edge end before the bus.
void SteppedTwin::close() {
  if (!process_.is_this_one()) return;
  const auto lock = hold();
  if (session_) session_->end();
  session_.reset();
  recorder_.reset();
  sink_.reset();
  subscriptions_.clear();
  edge_.reset();
  twin_.reset();
}

bool SteppedTwin::is_closed() const {
  if (!process_.is_this_one()) return true;
  const auto lock = hold();
  return twin_ == nullptr;
}

// A thread of the parent may have held the mutex when the process was forked; nothing releases it here.
std::unique_lock<FairMutex> SteppedTwin::hold() const {
  process_.check("the twin");
  return std::unique_lock(mutex_);
}

Twin& SteppedTwin::twin() const {
  if (!twin_)
    throw InputError("python.closed", {}, "the twin is closed",
                     "use it inside its with block, or make another one");
  return *twin_;
}

std::vector<LogLine> SteppedTwin::take_log() {
  process_.check("the twin");
  const std::lock_guard lock(lines_mutex_);
  std::vector<LogLine> out(lines_.begin(), lines_.end());
  lines_.clear();
  return out;
}

void SteppedTwin::check_present(std::size_t robot) const {
  if (robots_.at(robot).removed) refuse_removed(robots_[robot]);
}

TwinRobot* SteppedTwin::find(const RobotArrays& arrays) const {
  TwinRobot* const found = twin().find_robot(arrays.name_space);
  return found != nullptr && found->shared_machine() == arrays.machine.lock() ? found : nullptr;
}

TwinRobot& SteppedTwin::robot_of(const RobotArrays& arrays) const {
  TwinRobot* const found = find(arrays);
  if (found == nullptr) refuse_removed(arrays);
  return *found;
}

void SteppedTwin::check_command(std::size_t robot, std::size_t driven) const {
  const auto lock = hold();
  const RobotArrays& arrays = robots_.at(robot);
  const TwinRobot& commanded = robot_of(arrays);
  const std::string& joint = joint_name(commanded, arrays.driven.at(driven));
  if (const std::string controller = controller_of(commanded, joint); !controller.empty())
    throw InputError({claimed(controller, {joint})});
}

// A controller writes its command in each of its ticks, so that both would take turns. A command that stayed
// in the array would refuse every later call, too.
void SteppedTwin::discard_claimed_commands() {
  std::map<std::string, std::vector<std::string>> refused;  // joints by controllers
  for (RobotArrays& arrays : robots_) {
    const TwinRobot* const commanded = find(arrays);
    for (std::size_t i = 0; commanded != nullptr && i < arrays.command.size(); ++i) {
      if (std::isnan(arrays.command[i]) || same_bits(arrays.command[i], arrays.applied[i])) continue;
      const std::string& joint = joint_name(*commanded, arrays.driven[i]);
      const std::string controller = controller_of(*commanded, joint);
      if (controller.empty()) continue;
      refused[controller].push_back(joint);
      arrays.command[i] = arrays.applied[i];
    }
  }
  if (refused.empty()) return;
  std::vector<Diagnostic> why;
  for (const auto& [controller, joints] : refused) why.push_back(claimed(controller, joints));
  throw InputError(std::move(why));
}

void SteppedTwin::apply_commands() {
  discard_claimed_commands();
  for (RobotArrays& arrays : robots_) {
    TwinRobot* const commanded = find(arrays);
    if (commanded == nullptr) continue;
    Instance& instance = commanded->instance();
    for (std::size_t i = 0; i < arrays.command.size(); ++i) {
      const double command = arrays.command[i];
      const bool changed = !same_bits(command, arrays.applied[i]);
      if (std::isnan(command) && !changed) continue;
      const DriveMode mode = std::isnan(command) ? DriveMode::passive : DriveMode::position;
      if (instance.drive(arrays.driven[i]) != mode) instance.set_drive(arrays.driven[i], mode);
      if (mode == DriveMode::position) instance.set_target(arrays.driven[i], command);
      arrays.applied[i] = command;
    }
  }
}

void SteppedTwin::copy_state() {
  for (RobotArrays& arrays : robots_) {
    const TwinRobot* const shown = find(arrays);
    arrays.removed = shown == nullptr;
    if (shown == nullptr) continue;
    const Instance& instance = shown->instance();
    std::ranges::copy(instance.q(), arrays.q.begin());
    std::ranges::copy(instance.v(), arrays.v.begin());
    const auto effort = instance.drive_effort();
    for (const ModelJoint& joint : shown->model().joints) {
      if (joint.scalar())
        arrays.effort[static_cast<std::size_t>(joint.v)] =
            effort[static_cast<std::size_t>(joint.child_link - 1)];
    }
  }
}

// `enough`: true ends them early.
void SteppedTwin::take_steps(std::uint64_t steps, const bool* enough) {
  apply_commands();
  Twin& running = twin();
  for (std::uint64_t i = 0; i < steps && !running.diverged() && !(enough != nullptr && *enough); ++i) {
    running.between_steps();
    running.step();
    if (!subscriptions_.empty()) receive();
    if (recorder_) recorder_->let_catch_up();
  }
  copy_state();
  if (running.diverged())
    throw InputError("run.diverged", {},
                     fmt::format("the physics diverged at t = {:.3f} s", to_seconds(running.now())),
                     "look for small masses on strong joints, or pass a smaller step");
}

void SteppedTwin::step(std::uint64_t steps) {
  const auto lock = hold();
  take_steps(steps);
}

void SteppedTwin::reset() {
  const auto lock = hold();
  twin().reset();
  for (RobotArrays& arrays : robots_) {
    std::ranges::fill(arrays.command, kNone);
    arrays.applied = arrays.command;
  }
  copy_state();
}

void SteppedTwin::set_state(std::size_t robot_index, const std::vector<double>& q,
                            const std::vector<double>& v) {
  const auto lock = hold();
  TwinRobot& changed = robot_of(robots_.at(robot_index));
  changed.instance().set_state(q, v);
  changed.state_written(twin().now());
  twin().publish_state();
  copy_state();
}

std::shared_ptr<const SavedState> SteppedTwin::save() {
  const auto lock = hold();
  return twin().save();
}

void SteppedTwin::restore(const SavedState& state) {
  const auto lock = hold();
  if (const Status restored = twin().restore(state); !restored)
    throw InputError("state.restore", {}, "the state cannot be restored: " + restored.why(),
                     "restore it into the twin that it was saved from");
  copy_state();
}

std::string SteppedTwin::view(int port) {
  const auto lock = hold();
  if (!session_) {
    SessionOptions options;
    options.server.port = port;
    options.server.page_folder = page_folder();
    options.bundled = {data_folder() / "robots", data_folder() / "datasheets"};
    options.reload = options.rewind = false;
    auto session = std::make_unique<TwinSession>(twin(), options, log_);
    session->begin();
    session_ = std::move(session);
    twin().publish_state();
  }
  return session_->server().server().page_url();
}

void SteppedTwin::record(const std::string& file) {
  const auto lock = hold();
  if (recorder_)
    throw InputError("python.recording", {},
                     fmt::format("'{}' is still recorded", recorder_->folder().string()),
                     "end it first, by stop() or the end of its with block");
  auto sink = std::make_unique<McapFileSink>(file);
  RecorderOptions options;
  if (twin().steps_taken() == 0) {
    RunRecordingOptions whole_run;
    whole_run.version = version();
    options = run_recorder_options(twin(), std::move(whole_run), log_);
  } else {
    options.topics.all = true;
  }
  options.bag.folder = file;
  options.bag.sink = sink.get();
  recorder_ = std::make_unique<BusRecorder>(twin().bus(), std::move(options), log_);
  sink_ = std::move(sink);
}

std::uint64_t SteppedTwin::stop_recording() {
  if (!process_.is_this_one()) return 0;
  const auto lock = hold();
  if (!recorder_) return 0;
  const RecorderReport report = recorder_->stop();
  recorder_.reset();
  sink_.reset();
  if (!report.failure.empty())
    throw InputError("output.unwritable", {}, "the recording ended early: " + report.failure);
  return report.messages;
}

}  // namespace doppel::python
