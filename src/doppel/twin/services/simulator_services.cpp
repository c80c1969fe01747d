#include "doppel/twin/services/detail/simulator_services.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/ros/bus/standard_node.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/entities/entity.h"
#include "doppel/twin/loop/load_range.h"
#include "doppel/twin/services/detail/introspection.h"
#include "doppel/twin/services/detail/service_answer.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxLoads = 256;
constexpr std::size_t kMaxLoadsNamed = 3;

// A wrench with the moment of its force about the link's origin.
Status check_wrench(const Instance& instance, const Eigen::Vector3d& arm_W, const Eigen::Vector3d& force_W,
                    const Eigen::Vector3d& torque_W) {
  if (!force_W.allFinite() || !torque_W.allFinite() || !arm_W.allFinite())
    return Status::refused("the wrench is not finite");
  const WrenchRange range = max_wrench(instance);
  if (!(force_W.norm() <= range.force)) {
    return Status::refused(
        fmt::format("the force is {:g} N; on '{}' it can be up to {:.3g} N ({:g} m/s^2 by its mass)",
                    force_W.norm(), instance.name(), range.force, kMaxLoadAcceleration));
  }
  const double moment = torque_W.norm() + arm_W.norm() * force_W.norm();
  if (moment <= range.moment) return {};
  return Status::refused(
      fmt::format("the torque, with that of the force about the link's origin, is {:g} N m; on '{}' it can "
                  "be up to {:.3g} "
                  "N m (by its mass and inertia)",
                  moment, instance.name(), range.moment));
}

}  // namespace

SimulatorServices::SimulatorServices(TwinCore& core) : core_(core), node_(core.bus(), "/gazebo") {
  loads_.reserve(kMaxLoads);
  make_standard(node_);
  declare_introspection(node_, core.scenario().ros);
  offer_time_services();
  offer_step();
  offer_joint_efforts();
  offer_link_wrenches();
  offer_joint_state();
}

void SimulatorServices::reset(Time /*now*/) {
  loads_.clear();
  scene_.engine().clear_applied();
  next_change_ = pause_at_ = Time::max();
}

void SimulatorServices::save(SavedSlot& slot) {
  Saved& out = value_in<Saved>(slot);
  out.loads = loads_;
  out.next_change = next_change_;
  out.pause_at = pause_at_;
}

void SimulatorServices::restore(const SavedPart* saved, Time /*now*/) {
  const Saved* const before = value_of<Saved>(saved);
  if (before == nullptr) return;
  loads_ = before->loads;
  next_change_ = before->next_change;
  pause_at_ = before->pause_at;
  const auto& instances = scene_.engine().world().instances();
  const auto is_other = [&instances](const Load& load) {
    const auto index = static_cast<std::size_t>(load.body.instance);
    return index >= instances.size() || instances[index].model != load.model;
  };
  if (std::ranges::any_of(loads_, is_other)) instances_changed();  // after a reload
}

void SimulatorServices::instances_changed() {
  std::erase_if(loads_, [this](Load& load) {
    load.body.instance = scene_.find(load.name);
    if (load.body.instance < 0) return true;
    const Instance now = scene_.instance(load.body.instance);
    if (now.made_of().model == load.model) return false;
    // After a reload the robot's model may have the joint or link under another index, or not at all.
    if (!scene_.is_robot(load.body.instance)) return true;
    const Model& model = now.model();
    if (load.joint >= 0)
      load.joint = model.find_joint(load.model->joints[static_cast<std::size_t>(load.joint)].name);
    else
      load.body.link = model.find_link(load.model->links[static_cast<std::size_t>(load.body.link)].name);
    load.model = now.made_of().model;
    return load.joint < 0 && load.body.link < 0;
  });
  next_change_ = Time{};
}

Status SimulatorServices::find_body(const std::string& name, Load& load) const {
  Entity entity;
  if (find_object(scene_, name, entity)) {
    load.body = entity.body;
    load.p_BoP_B = entity.X_BE * load.p_BoP_B;
    return {};
  }
  return find_link(scene_, name, load.body);
}

// The sum of the efforts on one joint.
double SimulatorServices::effort_on(int instance, int joint, Time now) const {
  double sum = 0.0;
  for (const Load& load : loads_) {
    const bool here = load.body.instance == instance && load.joint == joint;
    if (here && load.start <= now && now < load.end) sum += load.effort;
  }
  return sum;
}

void SimulatorServices::apply_due(Time now) {
  scene_.engine().clear_applied();
  next_change_ = Time::max();
  for (const Load& load : loads_) {
    if (load.end <= now) continue;  // removed between steps, where memory may be freed
    if (load.start > now) {
      next_change_ = std::min(next_change_, load.start);
      continue;
    }
    next_change_ = std::min(next_change_, load.end);
    Instance instance = scene_.instance(load.body.instance);
    if (load.joint >= 0) {
      instance.apply_joint_effort(load.joint, effort_on(load.body.instance, load.joint, now));
    } else {
      instance.apply_wrench(load.body.link, load.p_BoP_B, load.force_W, load.torque_W);
    }
  }
}

std::string SimulatorServices::acting_loads() const {
  const Time now = scene_.now();
  std::vector<std::string> texts;
  for (const Load& load : loads_) {
    if (load.start > now || now >= load.end) continue;
    const Model& model = *load.model;
    texts.push_back(load.joint >= 0 ? fmt::format("{:g} N m act on joint '{}'", load.effort,
                                                  model.joints[static_cast<std::size_t>(load.joint)].name)
                                    : fmt::format("a force of {:g} N and a torque of {:g} N m act on '{}'",
                                                  load.force_W.norm(), load.torque_W.norm(), load.name));
  }
  const std::size_t named = std::min(texts.size(), kMaxLoadsNamed);
  std::string out =
      fmt::format("{}", fmt::join(texts.begin(), texts.begin() + static_cast<std::ptrdiff_t>(named), ", "));
  if (texts.size() > named) out += fmt::format(" and {} more", texts.size() - named);
  return out;
}

Status SimulatorServices::check_effort(const std::string& name, const Load& load) const {
  if (!std::isfinite(load.effort))
    return Status::refused(fmt::format("the effort on '{}' is not a finite number", name));
  double sum = load.effort;
  for (const Load& other : loads_) {
    if (other.body.instance == load.body.instance && other.joint == load.joint && other.end > scene_.now())
      sum += other.effort;
  }
  const double limit = max_effort(scene_.instance(load.body.instance), load.joint);
  if (std::abs(sum) <= limit) return {};
  return Status::refused(
      fmt::format("the effort on '{}' {} {:g}; it can be from {:.3g} to {:.3g} ({:g} times the effort limit, "
                  "or {:g} rad/s^2 or "
                  "m/s^2 by the inertia that the joint moves)",
                  name, sum == load.effort ? "is" : "would be, with those that act already,", sum, -limit,
                  limit, kMaxLimitFactor, kMaxLoadAcceleration));
}

Status SimulatorServices::add_load(Load load, const builtin_interfaces::msg::Time& start,
                                   const builtin_interfaces::msg::Duration& duration) {
  const Instance instance = scene_.instance(load.body.instance);
  load.name = instance.name();
  load.model = instance.made_of().model;
  std::erase_if(loads_, [this](const Load& old) { return old.end <= scene_.now(); });
  if (loads_.size() >= kMaxLoads)
    return Status::refused("too many efforts and wrenches are active; clear some");
  const Duration acts = from_msg(duration);
  if (acts == Duration::zero()) {
    return Status::refused(
        "the duration is zero, so it has no effect; use for example duration: {sec: 1}, or {sec: -1} to "
        "apply it until cleared");
  }
  load.start = std::max(node_.bus().from_stamp(from_msg(start)), scene_.now());
  load.end = acts < Duration::zero() ? Time::max() : load.start + acts;
  std::erase_if(loads_, [&load](const Load& old) { return load.on_same_body(old); });
  loads_.push_back(std::move(load));
  next_change_ = Time{};
  return {};
}

void SimulatorServices::offer_time_services() {
  using std_srvs::srv::Empty;
  const auto offer = [this](const char* name, std::function<void()> action) {
    node_.serve<Empty>(
        name, [action = std::move(action)](const Empty::Request&, Responder<Empty::Response> respond) {
          action();
          respond({});
        });
  };
  offer("~/pause_physics", [this] { pause(); });
  offer("~/unpause_physics", [this] {
    if (const Status status = resume(); !status)
      core_.log().warning("gazebo", "unpause_physics: " + status.why());
  });
  offer("~/reset_simulation", [this] { core_.reset(); });
  offer("~/reset_world", [this] { core_.reset(); });

  using doppel_msgs::srv::SetSpeed;
  node_.serve<SetSpeed>("~/set_speed", [this](const SetSpeed::Request& request,
                                              Responder<SetSpeed::Response> respond) {
    Status status;
    if (request.factor != 0.0 && !(request.factor >= kMinSpeed && request.factor <= kMaxSpeed)) {
      status = Status::refused(fmt::format(
          "the factor is {}; it can be from {:g} to {:g}, where 1 is real time, or 0: as fast as possible",
          request.factor, kMinSpeed, kMaxSpeed));
    } else {
      time_control_.speed = request.factor;
    }
    respond(answer<SetSpeed::Response>(status, "set"));
  });
}

Status SimulatorServices::can_take_steps() const {
  if (!scene_.engine().diverged()) return {};
  return Status::refused("the physics has diverged, so no step can be taken; call /gazebo/reset_simulation");
}

Status SimulatorServices::resume() {
  if (Status possible = can_take_steps(); !possible) return possible;
  time_control_.paused = false;
  time_control_.steps_owed = 0;
  refuse_owed_steps("the simulation was resumed; not all steps were taken");
  return {};
}

void SimulatorServices::refuse_owed_steps(const std::string& why) {
  for (const Stepping& call : std::exchange(stepping_, {}))
    call.respond({false, why, to_seconds(scene_.now())});
}

Status SimulatorServices::step(std::uint32_t steps) {
  if (Status possible = can_take_steps(); !possible) return possible;
  if (stepping_.empty()) steps_asked_ = time_control_.steps_owed;
  time_control_.steps_owed += steps;
  steps_asked_ += steps;
  return {};
}

void SimulatorServices::offer_step() {
  using doppel_msgs::srv::Step;
  node_.serve<Step>("~/step", [this](const Step::Request& request, Responder<Step::Response> respond) {
    if (!time_control_.paused) {
      respond(
          {false, "the simulation is running; call /gazebo/pause_physics first", to_seconds(scene_.now())});
      return;
    }
    if (const Status status = step(request.steps); !status)
      return respond({false, status.why(), to_seconds(scene_.now())});
    stepping_.push_back({request.steps, steps_asked_, std::move(respond)});
  });
}

void SimulatorServices::answer_finished_steps() {
  if (const Status possible = can_take_steps(); !possible) return refuse_owed_steps(possible.why());
  const std::uint64_t made = steps_asked_ - time_control_.steps_owed;
  const auto first_unfinished = std::find_if(stepping_.begin(), stepping_.end(),
                                             [made](const Stepping& call) { return call.last > made; });
  const std::vector<Stepping> finished(stepping_.begin(), first_unfinished);
  stepping_.erase(stepping_.begin(), first_unfinished);
  for (const Stepping& call : finished) {
    call.respond({true, fmt::format("{} steps", call.steps), to_seconds(scene_.now())});
  }
}

// A drive that holds the joint resists the effort, so that the joint hardly moves.
std::string SimulatorServices::effort_text(int index, int joint,
                                           const gazebo_msgs::srv::ApplyJointEffort::Request& request) const {
  const Instance instance = scene_.instance(index);
  const bool slides = instance.model().joints[static_cast<std::size_t>(joint)].type == JointType::prismatic;
  const char* const unit = slides ? "N" : "N m";
  std::string out = fmt::format("{} {} act on '{}'", request.effort, unit, request.joint_name);
  const DriveMode mode = instance.drive(joint);
  if (mode != DriveMode::position && mode != DriveMode::velocity) return out;
  const double limit = instance.made_of().servos[static_cast<std::size_t>(joint)].effort;
  return out + fmt::format(
                   "; its drive {} with up to {:.4g} {}, so it moves little: deactivate the controller "
                   "that commands it to let it move",
                   mode == DriveMode::position ? "holds its position" : "keeps its velocity", limit, unit);
}

void SimulatorServices::offer_joint_efforts() {
  using gazebo_msgs::srv::ApplyJointEffort;
  node_.serve<ApplyJointEffort>(
      "~/apply_joint_effort",
      [this](const ApplyJointEffort::Request& request, Responder<ApplyJointEffort::Response> respond) {
        Load load;
        Status status = find_scalar_joint(scene_, request.joint_name, load.body.instance, load.joint);
        load.effort = request.effort;
        if (status) status = check_effort(request.joint_name, load);
        if (status) status = add_load(load, request.start_time, request.duration);
        respond(answer<ApplyJointEffort::Response>(
            status, status ? effort_text(load.body.instance, load.joint, request) : ""));
      });
  using gazebo_msgs::srv::JointRequest;
  const auto clear = [this](const JointRequest::Request& request, Responder<JointRequest::Response> respond) {
    int robot = -1, joint = -1;
    if (find_scalar_joint(scene_, request.joint_name, robot, joint)) {
      std::erase_if(loads_,
                    [&](const Load& load) { return load.joint == joint && load.body.instance == robot; });
      next_change_ = Time{};
    }
    respond({});
  };
  node_.serve<JointRequest>("~/clear_joint_efforts", clear);
  node_.serve<JointRequest>("~/clear_joint_forces", clear);  // ROS 1's name
}

Status SimulatorServices::add_wrench(const std::string& body, const std::string& frame,
                                     const geometry_msgs::msg::Point& point,
                                     const geometry_msgs::msg::Wrench& wrench,
                                     const builtin_interfaces::msg::Time& start,
                                     const builtin_interfaces::msg::Duration& duration) {
  Load load;
  load.p_BoP_B = {point.x, point.y, point.z};
  if (const Status found = find_body(body, load); !found) return found;
  const Instance instance = scene_.instance(load.body.instance);
  if (scene_.is_object(load.body.instance) && !instance.made_of().floating())
    return Status::refused(
        fmt::format("'{}' is fixed to the world, so forces have no effect", instance.name()));
  EntityMotion reference;
  if (const Status found = find_frame(scene_, frame, reference); !found) return found;
  const Eigen::Matrix3d R_WF = reference.X_WE.linear();
  load.force_W = R_WF * from_msg(wrench.force);
  load.torque_W = R_WF * from_msg(wrench.torque);
  const Eigen::Vector3d arm_W = instance.link_pose(load.body.link).linear() * load.p_BoP_B;
  if (const Status fits = check_wrench(instance, arm_W, load.force_W, load.torque_W); !fits) return fits;
  return add_load(std::move(load), start, duration);
}

void SimulatorServices::offer_link_wrenches() {
  using gazebo_msgs::srv::ApplyBodyWrench;
  using gazebo_msgs::srv::ApplyLinkWrench;
  node_.serve<ApplyLinkWrench>("~/apply_link_wrench", [this](const ApplyLinkWrench::Request& r,
                                                             Responder<ApplyLinkWrench::Response> respond) {
    respond(answer<ApplyLinkWrench::Response>(
        add_wrench(r.link_name, r.reference_frame, r.reference_point, r.wrench, r.start_time, r.duration),
        "acts"));
  });
  node_.serve<ApplyBodyWrench>("~/apply_body_wrench", [this](const ApplyBodyWrench::Request& r,
                                                             Responder<ApplyBodyWrench::Response> respond) {
    respond(answer<ApplyBodyWrench::Response>(
        add_wrench(r.body_name, r.reference_frame, r.reference_point, r.wrench, r.start_time, r.duration),
        "acts"));
  });
  const auto clear = [this](const std::string& name) {
    Load meant;
    if (!find_body(name, meant)) return;
    std::erase_if(loads_, [&meant](const Load& load) { return meant.on_same_body(load); });
    next_change_ = Time{};
  };
  using gazebo_msgs::srv::BodyRequest;
  using gazebo_msgs::srv::LinkRequest;
  node_.serve<LinkRequest>("~/clear_link_wrenches",
                           [clear](const LinkRequest::Request& r, Responder<LinkRequest::Response> respond) {
                             clear(r.link_name);
                             respond({});
                           });
  node_.serve<BodyRequest>("~/clear_body_wrenches",
                           [clear](const BodyRequest::Request& r, Responder<BodyRequest::Response> respond) {
                             clear(r.body_name);
                             respond({});
                           });
}

Status SimulatorServices::write_state(const std::vector<std::string>& names,
                                      const std::vector<double>& positions,
                                      const std::vector<double>& velocities) {
  if (names.size() != positions.size() || (!velocities.empty() && velocities.size() != names.size())) {
    return Status::refused(fmt::format("{} names, {} positions and {} velocities do not match", names.size(),
                                       positions.size(), velocities.size()));
  }
  struct State {
    Eigen::VectorXd q, v;
  };
  std::map<int, State> robots;  // the named ones; without names, every robot is set to rest at its position
  const auto state_of = [&](int robot) -> State& {
    const Instance instance = scene_.instance(robot);
    const auto [at, fresh] = robots.try_emplace(robot);
    if (fresh) {
      at->second.q = Eigen::Map<const Eigen::VectorXd>(instance.q().data(), instance.model().nq);
      at->second.v = Eigen::VectorXd::Zero(instance.model().nv);
    }
    return at->second;
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    int robot = -1, index = -1;
    if (const Status found = find_scalar_joint(scene_, names[i], robot, index); !found) return found;
    const ModelJoint& joint = scene_.instance(robot).model().joints[static_cast<std::size_t>(index)];
    const double velocity = velocities.empty() ? 0.0 : velocities[i];
    if (const Status fits = check_joint_state(names[i], joint, positions[i], velocity); !fits) return fits;
    State& state = state_of(robot);
    state.q[joint.q] = positions[i];
    state.v[joint.v] = velocity;
  }
  if (names.empty()) {
    for (const int robot : scene_.robots()) static_cast<void>(state_of(robot));
  }
  std::vector<int> written;
  for (auto& [robot, state] : robots) {
    written.push_back(robot);
    Instance instance = scene_.instance(robot);
    instance.model().apply_mimics(state.q);
    instance.set_state({state.q.data(), static_cast<std::size_t>(state.q.size())},
                       {state.v.data(), static_cast<std::size_t>(state.v.size())});
  }
  core_.state_written(written);
  return {};
}

void SimulatorServices::fill_state(doppel_msgs::srv::GetState::Response& response) const {
  response.sim_time = to_seconds(scene_.now());
  for (const int robot : scene_.robots()) {
    const Instance instance = scene_.instance(robot);
    const Model& model = instance.model();
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const ModelJoint& joint = model.joints[j];
      if (!joint.scalar()) continue;
      response.names.push_back(scene_.scoped(robot, joint.name));
      response.positions.push_back(instance.q()[static_cast<std::size_t>(joint.q)]);
      response.velocities.push_back(instance.v()[static_cast<std::size_t>(joint.v)]);
      response.efforts.push_back(instance.drive_effort()[j]);
    }
  }
}

void SimulatorServices::offer_joint_state() {
  using doppel_msgs::srv::GetState;
  node_.serve<GetState>("~/get_state",
                        [this](const GetState::Request&, Responder<GetState::Response> respond) {
                          GetState::Response response;
                          fill_state(response);
                          respond(response);
                        });
  using doppel_msgs::srv::SetState;
  node_.serve<SetState>(
      "~/set_state", [this](const SetState::Request& r, Responder<SetState::Response> respond) {
        respond(answer<SetState::Response>(write_state(r.names, r.positions, r.velocities), "set"));
      });
  using gazebo_msgs::srv::SetModelConfiguration;
  node_.serve<SetModelConfiguration>(
      "~/set_model_configuration",
      [this](const SetModelConfiguration::Request& r, Responder<SetModelConfiguration::Response> respond) {
        std::vector<std::string> names = r.joint_names;
        const int robot = scene_.find(r.model_name);
        if (robot >= 0 && scene_.is_robot(robot)) {
          for (std::string& name : names) name = r.model_name + "::" + name;
        }
        respond(answer<SetModelConfiguration::Response>(write_state(names, r.joint_positions, {}), "set"));
      });
  using gazebo_msgs::srv::GetJointProperties;
  node_.serve<GetJointProperties>(
      "~/get_joint_properties",
      [this](const GetJointProperties::Request& r, Responder<GetJointProperties::Response> respond) {
        int robot = -1, index = -1;
        auto response =
            answer<GetJointProperties::Response>(find_scalar_joint(scene_, r.joint_name, robot, index), "");
        if (response.success) {
          const Instance instance = scene_.instance(robot);
          const ModelJoint& joint = instance.model().joints[static_cast<std::size_t>(index)];
          using Response = GetJointProperties::Response;
          response.type = joint.type == JointType::prismatic    ? Response::PRISMATIC
                          : joint.type == JointType::continuous ? Response::CONTINUOUS
                                                                : Response::REVOLUTE;
          response.damping = {joint.damping};
          response.position = {instance.q()[static_cast<std::size_t>(joint.q)]};
          response.rate = {instance.v()[static_cast<std::size_t>(joint.v)]};
        }
        respond(response);
      });
}

}  // namespace doppel
