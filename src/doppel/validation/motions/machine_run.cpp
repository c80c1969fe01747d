#include "doppel/validation/motions/machine_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/lab/headless_run/headless_run.h"
#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "doppel/scenario/schema/command_kind.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

constexpr const char* kClient = "/doppel_validate";
constexpr const char *kSetPositions = "/gazebo/set_model_configuration",
                     *kApplyEffort = "/gazebo/apply_joint_effort";

Scenario scenario_of(const CheckContext& context, const MachineOptions& options) {
  Scenario out = context.subject.scenario;
  if (options.step) out.step = options.step;
  out.start_controllers = options.start_controllers;
  out.enforce_limits = options.enforce_limits;
  return out;
}

// The type of the topic of a way.
std::string_view message_type(JointWay::Kind kind) {
  switch (kind) {
    case JointWay::Kind::forward:
      return std_msgs::msg::Float64MultiArray::kType;
    case JointWay::Kind::reference:
      return control_msgs::msg::MultiDOFCommand::kType;
    default:
      break;
  }
  return trajectory_msgs::msg::JointTrajectory::kType;
}

// "Revolute 1/position" is a joint and its interface.
std::pair<std::string, std::string> parts_of(const std::string& interface) {
  const std::size_t slash = interface.rfind('/');
  return {interface.substr(0, slash), slash == std::string::npos ? "" : interface.substr(slash + 1)};
}

}  // namespace

std::string position_text(double value, bool slides) {
  return slides ? fmt::format("{:.4g} mm", 1e3 * value) : fmt::format("{:.4g} rad", value);
}

std::string speed_text(double value, bool slides) {
  return slides ? fmt::format("{:.4g} mm/s", 1e3 * value) : fmt::format("{:.4g} rad/s", value);
}

MachineRun::MachineRun(const CheckContext& context, const MachineOptions& options) {
  log_.add_sink([this](const LogLine& line) {
    const std::lock_guard lock(lines_mutex_);
    lines_.push_back(line);
  });
  twin_ = std::make_unique<Twin>(scenario_of(context, options), log_, diagnostics_);
  edge_ = twin_->bus().attach(kClient);
  for (const std::string& name : model().driven_joint_names()) {
    if (context.joint.empty() || context.joint == name) joints_.push_back(model().find_joint(name));
  }
  if (options.payload) attach_payload(context);
  run(0.02);  // until controllers hold
}

MachineRun::~MachineRun() = default;

// A small body of the payload's mass, fixed to the tool: its weight and its inertia act.
void MachineRun::attach_payload(const CheckContext& context) {
  const ToolLoad& tool = context.suite.tool;
  int link = model().find_link(tool.link);
  if (link < 0 && !context.subject.arms.empty()) {
    const Chain& chain = context.subject.arms.front().chain;
    link = model().find_link(context.subject.model->links[static_cast<std::size_t>(chain.tip_link)].name);
  }
  if (link < 0 || tool.mass <= 0) return;
  constexpr double kRadius = 1e-3;  // m
  WorldObject payload;
  payload.name = "validation_payload";
  payload.shape = Sphere{kRadius};
  payload.mass = tool.mass;
  Instance robot = twin_->robot().instance();
  payload.X_WO = robot.link_pose(link);
  payload.X_WO.translation() = payload.X_WO * tool.p_LoC_L;
  CollisionMeshes meshes;
  Diagnostics none;
  Engine& engine = twin_->engine();
  engine.spawn(make_instance(payload, meshes, none));
  const BodyId held{engine.world().find(payload.name), engine.find(payload.name)->made_of().base_link()};
  static_cast<void>(engine.attach({robot.index(), link}, held));
}

std::vector<JointWay> MachineRun::ways(int index) const {
  std::vector<JointWay> out;
  const TwinRobot& robot = twin_->robot();
  for (const ControllerView& view : robot.controller_manager().controllers()) {
    const CommandKind kind = command_kind(view.type);
    const bool is_trajectory = kind == CommandKind::trajectory;
    if (view.state != ControllerState::active || (!is_trajectory && kind != CommandKind::forward)) continue;
    JointWay way;
    way.controller = view.name;
    bool has_joint = false;
    for (const std::string& command : view.required_commands) {
      const auto [name, interface] = parts_of(command);
      if (std::ranges::find(way.joints, name) != way.joints.end()) continue;
      if (name == joint(index).name) {
        has_joint = true;
        way.index = way.joints.size();
        way.interface = interface;
      }
      way.joints.push_back(name);
    }
    if (!has_joint) continue;
    const std::string node = in_namespace(robot.name_space(), view.name);
    way.kind = is_trajectory ? JointWay::Kind::trajectory : JointWay::Kind::forward;
    way.address = node + (is_trajectory ? "/joint_trajectory" : "/commands");
    out.push_back(way);
    if (!is_trajectory) continue;
    way.kind = JointWay::Kind::trajectory_action;
    way.address = node + "/follow_joint_trajectory";
    out.push_back(way);
  }
  return out;
}

std::optional<JointWay> MachineRun::reference_way(int index) const {
  constexpr std::string_view kPositionEnd = "/position";
  const TwinRobot& robot = twin_->robot();
  for (const ControllerView& view : robot.controller_manager().controllers()) {
    if (view.state != ControllerState::active || view.chained || !view.type.ends_with("PidController"))
      continue;
    JointWay way;
    way.kind = JointWay::Kind::reference;
    way.controller = view.name;
    way.address = in_namespace(robot.name_space(), view.name) + "/reference";
    bool has_joint = false;
    for (const std::string& reference : view.required_states) {
      if (!reference.ends_with(kPositionEnd)) continue;
      const std::string name = parts_of(reference).first;
      if (name == joint(index).name) {
        has_joint = true;
        way.index = way.joints.size();
      }
      way.joints.push_back(name);
    }
    if (has_joint) return way;
  }
  return std::nullopt;
}

std::vector<JointWay> MachineRun::service_ways(int index) const {
  JointWay position;
  position.joints = {joint(index).name};
  position.controller = position.address = kSetPositions;
  position.kind = JointWay::Kind::position_service;
  JointWay effort = position;
  effort.controller = effort.address = kApplyEffort;
  effort.interface = "effort";
  effort.kind = JointWay::Kind::effort_service;
  return {position, effort};
}

double MachineRun::position(int index) const {
  return twin_->robot().instance().q()[static_cast<std::size_t>(joint(index).q)];
}
double MachineRun::speed(int index) const {
  return twin_->robot().instance().v()[static_cast<std::size_t>(joint(index).v)];
}
double MachineRun::effort(int index) const {
  return twin_->robot().instance().drive_effort()[static_cast<std::size_t>(index)];
}

std::vector<std::pair<std::string, double>> MachineRun::posed() const {
  std::vector<std::pair<std::string, double>> out;
  for (std::size_t i = 0; i < model().joints.size(); ++i) {
    const ModelJoint& one = model().joints[i];
    if (one.scalar() && !one.mimics()) out.emplace_back(one.name, position(static_cast<int>(i)));
  }
  return out;
}

bool MachineRun::run(double seconds, const std::function<void()>& after_step,
                     const std::function<bool()>& is_over) {
  HeadlessOptions options;
  options.duration = from_seconds(seconds);
  if (is_over) options.until = [&](Twin&) { return is_over(); };
  if (after_step) options.observers.emplace_back([&](Twin&) { after_step(); });
  if (recording_ != nullptr) options.observers.emplace_back([&](Twin&) { recording_->take(); });
  const RunResult result = run_headless(*twin_, options);
  result.throw_if_failed();
  return result.end != RunEnd::diverged;
}

// Its response comes with the next step.
template <class Service>
void call_service(Edge& edge, const std::string& address, const typename Service::Request& request,
                  Status& out) {
  out = Status::refused("the twin has not answered");
  edge.call(address, to_cdr(request), [&out](const Status& status, const Bytes& cdr) {
    typename Service::Response response;
    out = status;
    if (status && from_cdr(cdr, response) && !response.success)
      out = Status::refused(response.status_message);
  });
}

void MachineRun::call(const JointWay& way, double value, double seconds) {
  if (way.kind == JointWay::Kind::position_service) {
    gazebo_msgs::srv::SetModelConfiguration::Request request;
    request.model_name = twin_->robot().name();
    request.joint_names = way.joints;
    request.joint_positions = {value};
    call_service<gazebo_msgs::srv::SetModelConfiguration>(*edge_, way.address, request, answer_);
    return;
  }
  gazebo_msgs::srv::ApplyJointEffort::Request request;
  request.joint_name = way.joints.front();
  request.effort = value;
  request.duration = to_duration_msg(from_seconds(seconds));
  call_service<gazebo_msgs::srv::ApplyJointEffort>(*edge_, way.address, request, answer_);
}

void MachineRun::send(const JointWay& way, double value, double seconds) {
  answer_ = {};
  if (way.kind == JointWay::Kind::position_service || way.kind == JointWay::Kind::effort_service)
    return call(way, value, seconds);
  std::vector<double> values;
  for (const std::string& name : way.joints) {
    const int other = model().find_joint(name);
    values.push_back(other >= 0 && way.interface == "position" ? position(other) : 0.0);
  }
  values[way.index] = value;
  if (way.kind == JointWay::Kind::forward) {
    std_msgs::msg::Float64MultiArray message;
    message.data = values;
    static_cast<void>(edge_->publish(kClient, way.address, message.kType, to_cdr(message)));
    return;
  }
  if (way.kind == JointWay::Kind::reference) {
    control_msgs::msg::MultiDOFCommand message;
    message.dof_names = way.joints;
    message.values = values;
    static_cast<void>(edge_->publish(kClient, way.address, message.kType, to_cdr(message)));
    return;
  }
  trajectory_msgs::msg::JointTrajectory trajectory;
  trajectory.joint_names = way.joints;
  auto& point = trajectory.points.emplace_back();
  (way.interface == "velocity" ? point.velocities
   : way.interface == "effort" ? point.effort
                               : point.positions) = values;
  point.time_from_start = to_duration_msg(from_seconds(seconds));
  if (way.kind == JointWay::Kind::trajectory) {
    static_cast<void>(edge_->publish(kClient, way.address, trajectory.kType, to_cdr(trajectory)));
    return;
  }
  using Follow = control_msgs::action::FollowJointTrajectory;
  SendGoal<Follow>::Request request;
  // A second goal with the id of an earlier one is refused.
  ++goals_;
  GoalId id{};
  for (std::size_t i = 0; i < sizeof goals_; ++i) id[i] = static_cast<std::uint8_t>(goals_ >> (8 * i));
  request.goal_id = {id};
  request.goal.trajectory = trajectory;
  edge_->call(way.address + "/_action/send_goal", to_cdr(request), [](const Status&, const Bytes&) {});
}

void MachineRun::drive_base(double speed, const std::function<void(double)>& observe) {
  constexpr int kCommands = 10;
  constexpr double kPeriod = 0.05;  // s, below the usual time-outs
  const Eigen::Vector3d start = twin_->robot().instance().base_pose().translation();
  for (int i = 0; i < kCommands; ++i) {
    geometry_msgs::msg::TwistStamped command;
    command.header.stamp = to_time_msg(twin_->now());
    command.twist.linear.x = speed;
    for (const TopicInfo& topic : twin_->bus().topics()) {
      if (topic.subscribers.empty()) continue;
      if (topic.type == command.kType)
        static_cast<void>(edge_->publish(kClient, topic.name, command.kType, to_cdr(command)));
      if (topic.type == geometry_msgs::msg::Twist::kType)
        static_cast<void>(edge_->publish(kClient, topic.name, command.twist.kType, to_cdr(command.twist)));
    }
    run(kPeriod, [&] { observe((twin_->robot().instance().base_pose().translation() - start).norm()); });
  }
}

Status MachineRun::place(const std::vector<std::pair<std::string, double>>& positions) {
  gazebo_msgs::srv::SetModelConfiguration::Request request;
  request.model_name = twin_->robot().name();
  for (const auto& [name, value] : positions) {
    request.joint_names.push_back(name);
    request.joint_positions.push_back(value);
  }
  Status out;
  call_service<gazebo_msgs::srv::SetModelConfiguration>(*edge_, kSetPositions, request, out);
  twin_->between_steps();
  run(0.05);  // controllers have taken over the pose
  return out;
}

void MachineRun::restore(const SavedState& state) {
  if (const Status status = twin_->restore(state); !status)
    throw InputError("validation.restore", {}, "the twin cannot be set back: " + status.why());
  static_cast<void>(take_lines());
  if (recording_ != nullptr) start_recording();
}

void MachineRun::start_recording() {
  recording_.reset();
  // A topic is recorded from its first publisher on, and the first message would be the whole command.
  for (const int joint : joints_) {
    std::vector<JointWay> all = ways(joint);
    if (const auto reference = reference_way(joint)) all.push_back(*reference);
    for (const JointWay& way : all) {
      if (way.kind == JointWay::Kind::trajectory_action) continue;
      static_cast<void>(edge_->advertise(kClient, way.address, message_type(way.kind), {}));
    }
  }
  twin_->between_steps();
  recording_ = std::make_unique<MotionRecording>(twin_->bus(), twin_->engine().world(), log_);
}

RecordedMotion MachineRun::finish_recording() {
  RecordedMotion out = recording_->finish();
  recording_.reset();
  return out;
}

std::vector<LogLine> MachineRun::take_lines() {
  const std::lock_guard lock(lines_mutex_);
  return std::exchange(lines_, {});
}

}  // namespace doppel
