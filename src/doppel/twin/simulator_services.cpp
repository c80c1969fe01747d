#include "doppel/twin/simulator_services.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "doppel/bus/standard_node.h"
#include "doppel/core/names.h"
#include "doppel/messages/std_srvs.h"
#include "doppel/twin/entity.h"
#include "doppel/twin/pose_messages.h"
#include "doppel/twin/service_answer.h"

namespace doppel {
namespace {

constexpr std::size_t kMostLoads = 256;
constexpr double kFastest = 1e6;

}  // namespace

SimulatorServices::SimulatorServices(Bus& bus, const Model& model, Engine& engine, Callbacks callbacks)
    : model_(model), engine_(&engine), callbacks_(std::move(callbacks)), node_(bus, "/gazebo") {
  loads_.reserve(kMostLoads);
  make_standard(node_);
  offer_time_services();
  offer_step();
  offer_joint_efforts();
  offer_link_wrenches();
  offer_joint_state();
}

void SimulatorServices::forget_loads() {
  loads_.clear();
  engine_->clear_applied();
  next_change_ = Time::max();
}

void SimulatorServices::forget_loads_of_gone_objects() {
  const auto forgotten = std::erase_if(loads_, [this](const Load& load) {
    return !load.object.empty() && find_named(engine_->objects(), load.object) == nullptr;
  });
  if (forgotten > 0) next_change_ = Time::zero();
}

void SimulatorServices::rebind(Engine& engine) {
  engine_ = &engine;
  forget_loads_of_gone_objects();
  next_change_ = Time::zero();
}

Status SimulatorServices::find_scalar_joint(const std::string& name, int& joint) const {
  joint = model_.find_joint(name);
  if (joint >= 0 && model_.joints[static_cast<std::size_t>(joint)].scalar()) return {};
  return Status::refused(
      fmt::format("there is no moving joint '{}'{}", name, did_you_mean(name, model_.scalar_joint_names())));
}

// The robot's scope is not looked at: in Gazebo it is called whatever it was spawned as.
Status SimulatorServices::find_body(const std::string& name, Load& load) const {
  Entity entity;
  if (find_object(*engine_, name, entity)) {
    load.object = entity.object;
    if (entity.shape) load.p_BoP_B = shape_in_object(*engine_, entity.object) * load.p_BoP_B;
    return {};
  }
  const std::size_t scope = name.rfind("::");
  const std::string plain = scope == std::string::npos ? name : name.substr(scope + 2);
  load.link = model_.find_link(plain);
  if (load.link >= 0) return {};
  std::vector<std::string> names;
  for (const ModelLink& l : model_.links) names.push_back(l.name);
  for (const WorldObject& object : engine_->objects()) names.push_back(object.name);
  return Status::refused(
      fmt::format("there is no link and no object '{}'{}", plain, did_you_mean(plain, names)));
}

// Efforts on one joint add up.
double SimulatorServices::effort_on(int joint, Time now) const {
  double sum = 0.0;
  for (const Load& load : loads_) {
    if (load.joint == joint && load.start <= now && now < load.end) sum += load.effort;
  }
  return sum;
}

void SimulatorServices::apply_due(Time now) {
  engine_->clear_applied();
  next_change_ = Time::max();
  for (const Load& load : loads_) {
    if (load.end <= now) continue;  // forgotten between steps, where memory may be given back
    if (load.start > now) {
      next_change_ = std::min(next_change_, load.start);
      continue;
    }
    next_change_ = std::min(next_change_, load.end);
    if (load.joint >= 0) {
      engine_->apply_joint_effort(load.joint, effort_on(load.joint, now));
    } else if (load.link >= 0) {
      engine_->apply_wrench(load.link, load.p_BoP_B, load.force_W, load.torque_W);
    } else {
      engine_->apply_object_wrench(load.object, load.p_BoP_B, load.force_W, load.torque_W);
    }
  }
}

Status SimulatorServices::add_load(Load load, const builtin_interfaces::msg::Time& start,
                                   const builtin_interfaces::msg::Duration& duration) {
  std::erase_if(loads_, [this](const Load& old) { return old.end <= engine_->time(); });
  if (loads_.size() >= kMostLoads)
    return Status::refused("too many efforts and wrenches act at once; clear some");
  const Duration acts = from_msg(duration);
  if (acts == Duration::zero()) {
    return Status::refused(
        "the duration is zero, so nothing would act; give for instance duration: {sec: 1}, or "
        "{sec: -1} for as long as it is not cleared");
  }
  load.start = std::max(node_.bus().from_stamp(from_msg(start)), engine_->time());
  load.end = acts < Duration::zero() ? Time::max() : load.start + acts;
  std::erase_if(loads_, [&load](const Load& old) { return load.on_same_body(old); });
  loads_.push_back(std::move(load));
  next_change_ = Time::zero();
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
  offer("~/pause_physics", [this] { time_control_.paused = true; });
  offer("~/unpause_physics", [this] {
    time_control_.paused = false;
    time_control_.steps_owed = 0;
    for (const Stepping& call : std::exchange(stepping_, {})) {
      call.respond(
          {false, "time runs again; not all of the steps were made one by one", to_seconds(engine_->time())});
    }
  });
  offer("~/reset_simulation", [this] { callbacks_.reset(); });
  offer("~/reset_world", [this] { callbacks_.reset(); });

  using doppel_msgs::srv::SetSpeed;
  node_.serve<SetSpeed>(
      "~/set_speed", [this](const SetSpeed::Request& request, Responder<SetSpeed::Response> respond) {
        Status status;
        if (!(request.factor >= 0.0 && request.factor <= kFastest)) {
          status = Status::refused(
              fmt::format("the factor is {}; 1 is real time, 0 as fast as it goes", request.factor));
        } else {
          time_control_.speed = request.factor;
        }
        respond(answer<SetSpeed::Response>(status, "set"));
      });
}

void SimulatorServices::offer_step() {
  using doppel_msgs::srv::Step;
  node_.serve<Step>("~/step", [this](const Step::Request& request, Responder<Step::Response> respond) {
    if (!time_control_.paused) {
      respond({false, "time is running; call /gazebo/pause_physics first", to_seconds(engine_->time())});
      return;
    }
    if (stepping_.empty()) steps_asked_ = time_control_.steps_owed;
    time_control_.steps_owed += request.steps;
    steps_asked_ += request.steps;
    stepping_.push_back({request.steps, steps_asked_, std::move(respond)});
  });
}

void SimulatorServices::answer_finished_steps() {
  const std::uint64_t made = steps_asked_ - time_control_.steps_owed;
  const auto first_unfinished = std::find_if(stepping_.begin(), stepping_.end(),
                                             [made](const Stepping& call) { return call.last > made; });
  const std::vector<Stepping> finished(stepping_.begin(), first_unfinished);
  stepping_.erase(stepping_.begin(), first_unfinished);
  for (const Stepping& call : finished) {
    call.respond({true, fmt::format("{} steps", call.steps), to_seconds(engine_->time())});
  }
}

void SimulatorServices::offer_joint_efforts() {
  using gazebo_msgs::srv::ApplyJointEffort;
  node_.serve<ApplyJointEffort>(
      "~/apply_joint_effort",
      [this](const ApplyJointEffort::Request& request, Responder<ApplyJointEffort::Response> respond) {
        Load load;
        Status status = find_scalar_joint(request.joint_name, load.joint);
        if (status && !std::isfinite(request.effort))
          status = Status::refused("the effort is not a finite number");
        load.effort = request.effort;
        if (status) status = add_load(load, request.start_time, request.duration);
        respond(answer<ApplyJointEffort::Response>(
            status, fmt::format("{} N m act on '{}'", request.effort, request.joint_name)));
      });
  using gazebo_msgs::srv::JointRequest;
  const auto clear = [this](const JointRequest::Request& request, Responder<JointRequest::Response> respond) {
    const int joint = model_.find_joint(request.joint_name);
    std::erase_if(loads_, [joint](const Load& load) { return load.joint >= 0 && load.joint == joint; });
    next_change_ = Time::zero();
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
  if (const auto* object = find_named(engine_->objects(), load.object); object && !(object->mass > 0))
    return Status::refused(fmt::format("'{}' is fixed to the world, so no force moves it", load.object));
  EntityMotion reference;
  if (const Status found = find_frame(model_, *engine_, frame, reference); !found) return found;
  const Eigen::Matrix3d R_WF = reference.X_WE.linear();
  load.force_W = R_WF * from_msg(wrench.force);
  load.torque_W = R_WF * from_msg(wrench.torque);
  if (!load.force_W.allFinite() || !load.torque_W.allFinite() || !load.p_BoP_B.allFinite()) {
    return Status::refused("the wrench is not made of finite numbers");
  }
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
    next_change_ = Time::zero();
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
  const auto now_q = engine_->q();
  Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(now_q.data(), model_.nq);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(model_.nv);
  for (std::size_t i = 0; i < names.size(); ++i) {
    int index = -1;
    if (const Status found = find_scalar_joint(names[i], index); !found) return found;
    const ModelJoint& joint = model_.joints[static_cast<std::size_t>(index)];
    const double velocity = velocities.empty() ? 0.0 : velocities[i];
    if (!std::isfinite(positions[i]) || !std::isfinite(velocity)) {
      return Status::refused(fmt::format("the state of '{}' is not a finite number", names[i]));
    }
    if (positions[i] < joint.lower || positions[i] > joint.upper) {
      return Status::refused(fmt::format("{} is outside the limits of '{}', [{}, {}]", positions[i], names[i],
                                         joint.lower, joint.upper));
    }
    q[joint.q] = positions[i];
    v[joint.v] = velocity;
  }
  model_.apply_mimics(q);
  engine_->set_state({q.data(), static_cast<std::size_t>(q.size())},
                     {v.data(), static_cast<std::size_t>(v.size())});
  callbacks_.state_written();
  return {};
}

void SimulatorServices::offer_joint_state() {
  using doppel_msgs::srv::GetState;
  node_.serve<GetState>("~/get_state",
                        [this](const GetState::Request&, Responder<GetState::Response> respond) {
                          GetState::Response response;
                          response.sim_time = to_seconds(engine_->time());
                          for (std::size_t j = 0; j < model_.joints.size(); ++j) {
                            const ModelJoint& joint = model_.joints[j];
                            if (!joint.scalar()) continue;
                            response.names.push_back(joint.name);
                            response.positions.push_back(engine_->q()[static_cast<std::size_t>(joint.q)]);
                            response.velocities.push_back(engine_->v()[static_cast<std::size_t>(joint.v)]);
                            response.efforts.push_back(engine_->drive_effort()[j]);
                          }
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
        respond(answer<SetModelConfiguration::Response>(write_state(r.joint_names, r.joint_positions, {}),
                                                        "set"));
      });
  using gazebo_msgs::srv::GetJointProperties;
  node_.serve<GetJointProperties>(
      "~/get_joint_properties",
      [this](const GetJointProperties::Request& r, Responder<GetJointProperties::Response> respond) {
        int index = -1;
        auto response = answer<GetJointProperties::Response>(find_scalar_joint(r.joint_name, index), "");
        if (index >= 0 && response.success) {
          const ModelJoint& joint = model_.joints[static_cast<std::size_t>(index)];
          using Response = GetJointProperties::Response;
          response.type = joint.type == JointType::prismatic    ? Response::PRISMATIC
                          : joint.type == JointType::continuous ? Response::CONTINUOUS
                                                                : Response::REVOLUTE;
          response.damping = {joint.damping};
          response.position = {engine_->q()[static_cast<std::size_t>(joint.q)]};
          response.rate = {engine_->v()[static_cast<std::size_t>(joint.v)]};
        }
        respond(response);
      });
}

}  // namespace doppel
