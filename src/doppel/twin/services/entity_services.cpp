#include "doppel/twin/services/detail/entity_services.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/description/gazebo/model_plugins.h"
#include "doppel/robot/collision/size_limits.h"
#include "doppel/ros/messages/printable.h"
#include "doppel/scenario/compile/compiled_scenario.h"
#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/loop/divergence.h"
#include "doppel/twin/loop/load_range.h"
#include "doppel/twin/services/detail/service_answer.h"
#include "doppel/twin/spawn/entity_mesh.h"

namespace doppel {
namespace {

// The base link in links[0].
Pose base_at_start(const ModelInstance& made) {
  Pose X = Pose::Identity();
  if (!made.floating()) return X;
  X.translation() = made.q0.head<3>();
  return X;
}

std::string joined(const std::vector<Diagnostic>& diagnostics) {
  std::string out;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (!out.empty()) out += "; ";
    if (diagnostic.where.known()) out += diagnostic.where.place() + ": ";
    out += diagnostic.message;
    if (!diagnostic.fix.empty()) out += fmt::format(" ({})", diagnostic.fix);
  }
  return out;
}

Status near_enough(const Pose& X_W) {
  if (X_W.translation().cwiseAbs().maxCoeff() <= kMaxDistance) return {};
  return Status::refused(fmt::format("the pose is more than {:g} m away", kMaxDistance));
}

struct DrivenEntity {
  WorldRobot robot;
  SdfModel model;  // in the world, under its name
};

// Takes the model that its plugins drive out of the entity.
std::optional<DrivenEntity> take_driven(EntityText& entity, const std::string& name,
                                        const EntityServices::Spawned& what,
                                        const std::vector<std::string>& taken, const std::string& world) {
  auto* const models = std::get_if<std::vector<SdfModel>>(&entity.made_of);
  if (models == nullptr) return std::nullopt;
  const auto whole = std::ranges::find(*models, entity.name, &SdfModel::name);
  if (whole == models->end() || whole->description->gazebo.empty()) return std::nullopt;
  RobotDescription description = *whole->description;
  description.name = name;
  if (!what.name_space.empty()) set_plugin_namespace(description, what.name_space);
  Diagnostics said_later;
  const auto mapped = map_model_plugins(description, world, said_later);
  if (!mapped) return std::nullopt;
  DrivenEntity out{{}, *whole};
  models->erase(whole);
  out.model.name = name;
  out.model.X_WR = what.X_WE * out.model.X_WR;
  out.model.description = std::make_shared<const RobotDescription>(std::move(description));
  out.robot.X_WR = out.model.X_WR;
  out.robot.base = out.model.base;
  out.robot.name_space = free_model_namespace(mapped->name_space, name, taken);
  return out;
}

}  // namespace

std::string EntityServices::free_name(const std::string& name, bool rename) const {
  if (!rename || scene_.find(name) < 0) return name;
  for (int i = 0;; ++i) {
    std::string other = fmt::format("{}_{}", name, i);
    if (scene_.find(other) < 0) return other;
  }
}

EntityServices::EntityServices(TwinCore& core) : core_(core), node_(core.bus(), "/gazebo") {
  advertise_spawning();
  offer_entity_state();
  offer_model_state();
}

Status EntityServices::check_name(const std::string& name) const {
  if (name.empty()) return Status::refused("the entity has no name, neither in the request nor in the xml");
  if (name.size() > kMaxNameLength || !is_printable_name(name) || name.find("::") != std::string::npos) {
    return Status::refused(
        fmt::format("a name has at most {} bytes of UTF-8, printable, not only spaces, and without '::'",
                    kMaxNameLength));
  }
  const int taken = scene_.find(name);
  const bool link = std::ranges::any_of(
      scene_.robots(), [&](int robot) { return scene_.instance(robot).model().find_link(name) >= 0; });
  if (is_world(name) || name == "ground" || link || (taken >= 0 && scene_.is_robot(taken)))
    return Status::refused(fmt::format("the name '{}' is already used by the robot or its world", name));
  if (taken >= 0)
    return Status::refused(
        fmt::format("there is already an object '{}'; choose another name, or delete it", name));
  if (scene_.objects().size() >= kMaxObjects)
    return Status::refused(fmt::format("the world has the maximum of {} objects", kMaxObjects));
  return {};
}

Status EntityServices::place_in(const std::string& frame, const geometry_msgs::msg::Pose& pose,
                                Pose& X_WE) const {
  EntityMotion reference;
  if (const Status found = find_frame(scene_, frame, reference); !found) return found;
  const std::optional<Pose> X_FE = from_msg(pose);
  if (!X_FE)
    return Status::refused("the pose is not valid: it needs a finite position and a unit quaternion");
  X_WE = reference.X_WE * *X_FE;
  return {};
}

void EntityServices::add_objects(std::vector<ModelInstance> objects) {
  if (objects.empty()) return;
  Engine& engine = scene_.engine();
  const std::string name = objects.front().name;
  const std::shared_ptr<const CompiledWorld> before = engine.compiled();
  std::vector<ModelInstance> instances = before->instances();
  for (ModelInstance& object : objects) instances.push_back(std::move(object));
  engine.set_instances(std::move(instances));
  if (const std::string why = spawned_divergence(engine); !why.empty()) {
    engine.continue_with(before);
    throw InputError("entity.diverges", {}, fmt::format("with '{}' {}", name, why),
                     "place it where it touches nothing, or change its size or mass");
  }
  core_.renew_handles();
}

void EntityServices::spawn(Spawned what, const SpawnDone& done) {
  try {
    if (const std::string robot = robot_in_xml(what.xml); !robot.empty())
      return spawn_urdf(what, robot, done);
    spawn_entity(what, done);
  } catch (const InputError& refused) {
    done(Status::refused(joined(refused.diagnostics())), "");
  }
}

// Objects, of which one is a robot if its plugins drive it.
void EntityServices::spawn_entity(const Spawned& what, const SpawnDone& done) {
  Diagnostics notes;
  EntityText entity = read_entity_xml(
      what.xml,
      [this](const std::string& uri) {
        return find_entity_mesh(
            uri, core_.machine().resolver,
            core_.robots().empty() ? Target{} : core_.robots().front()->machine().setup().target);
      },
      notes);
  const std::string name = free_name(what.name.empty() ? entity.name : what.name, what.rename);
  if (const Status free = check_name(name); !free) return done(free, "");
  std::optional<DrivenEntity> driven =
      take_driven(entity, name, what, namespaces(), scene_.engine().world().settings().name);
  std::vector<ModelInstance> made = instances_of(entity, name, what.X_WE, notes);
  for (const ModelInstance& one : made) {
    if (const Status near = near_enough(one.X_WR * base_at_start(one)); !near) return done(near, "");
  }
  if (driven) {
    if (const Status near = near_enough(driven->model.X_WR); !near) return done(near, "");
    return spawn_robot(std::move(driven->robot), std::move(driven->model), std::move(made), done);
  }
  add_objects(std::move(made));
  done({},
       fmt::format("'{}' is in the world{}{}", name, notes.all().empty() ? "" : "; ", joined(notes.all())));
}

void EntityServices::clone(const std::string& original, const Spawned& what, const SpawnDone& done) {
  const int index = scene_.find(original);
  if (index < 0 || scene_.is_robot(index)) {
    return done(Status::refused(fmt::format("'{}' is {}", original.substr(0, kMaxNameLength),
                                            index < 0 ? "no object" : "a robot, which cannot be cloned")),
                "");
  }
  const std::string name = free_name(what.name.empty() ? original : what.name, what.rename);
  Status status = check_name(name);
  if (status) status = near_enough(what.X_WE);
  if (!status) return done(status, "");
  ModelInstance copy = scene_.instance(index).made_of();
  copy.name = name;
  // The model's frame goes to the asked place, and the joints are as at a reset.
  const Pose X_WB = what.X_WE * copy.X_BO.inverse();
  if (copy.floating()) {
    const Pose X_RB = copy.X_WR.inverse() * X_WB;
    copy.q0.head<3>() = X_RB.translation();
    copy.q0.segment<4>(3) = Eigen::Quaterniond(X_RB.linear()).coeffs();  // x y z w
  } else {
    copy.X_WR = X_WB;
  }
  try {
    add_objects({std::move(copy)});
  } catch (const InputError& refused) {
    return done(Status::refused(joined(refused.diagnostics())), "");
  }
  done({}, fmt::format("'{}' is in the world", name));
}

void EntityServices::spawn_urdf(const Spawned& what, const std::string& robot, const SpawnDone& done) {
  WorldRobot wanted;
  wanted.X_WR = what.X_WE;
  for (const std::string* name : {&what.name_space, &what.name, &robot}) {
    if (wanted.name_space.empty()) wanted.name_space = *name;
  }
  if (wanted.name_space.starts_with('/')) wanted.name_space.erase(0, 1);
  wanted.name_space = free_name(wanted.name_space, what.rename);
  wanted.base = base_in_xml(what.xml);
  Status status = near_enough(what.X_WE);
  if (status) status = check_name(wanted.name_space);
  if (!status) return done(status, "");
  spawn_robot(std::move(wanted), what.xml, {}, done);
}

void EntityServices::spawn_robot(WorldRobot robot, SpawnedText text, std::vector<ModelInstance> others,
                                 const SpawnDone& done) {
  const auto* const model = std::get_if<SdfModel>(&text);
  const std::string name = model == nullptr ? robot.name_space : model->name;
  spawner_.spawn(
      std::move(robot), std::move(text),
      [this, done, name, others = std::move(others)](const Status& status) {
        const std::string there = fmt::format(
            "the robot '{}' is in the world; it was sent as XML, so it is not reloaded from files: delete it "
            "and spawn it again to change it",
            name);
        const Status whole = status.ok() ? add_parts(name, others) : status;
        if (whole) log_.note("gazebo", there);
        done(whole, there);
      });
}

// The parts of a spawned model that no joint connects with its robot; without them the robot is removed
// again.
Status EntityServices::add_parts(const std::string& robot, const std::vector<ModelInstance>& parts) {
  try {
    add_objects(parts);
    return {};
  } catch (const InputError& refused) {
    std::string why = joined(refused.diagnostics());
    const int index = scene_.find(robot);
    const Status removed = index < 0 ? Status() : remove_robot(index);
    if (!removed) why += "; what is in the world of it stays: " + removed.why();
    return Status::refused(why);
  }
}

std::vector<std::string> EntityServices::namespaces() const {
  std::vector<std::string> out;
  for (const auto& robot : core_.robots()) out.push_back(robot->name_space());
  return out;
}

Status EntityServices::remove_robot(int instance) {
  for (const auto& robot : core_.robots()) {
    if (robot->instance().index() == instance) return core_.remove_robot(robot->name_space());
  }
  return Status::refused("this robot does not belong to the twin");
}

// Parts of a model may be robots that its plugins drive, with controllers and nodes of their own.
Status EntityServices::remove_driven_parts(const std::string& model) {
  const auto is_part = [&](int robot) { return scene_.instance(robot).name().starts_with(model + "::"); };
  while (true) {
    const auto part = std::ranges::find_if(scene_.robots(), is_part);
    if (part == scene_.robots().end()) return {};
    if (Status removed = remove_robot(*part); !removed) return removed;
  }
}

Status EntityServices::remove(const std::string& name) {
  const int index = scene_.find(name);
  if (index >= 0 && scene_.is_robot(index)) return remove_robot(index);
  if (index >= 0) {
    if (Status removed = remove_driven_parts(name); !removed) return removed;
    std::vector<ModelInstance> left;  // without the parts of the model that no joint connects with it
    for (const ModelInstance& instance : scene_.engine().world().instances()) {
      if (instance.name != name && !instance.name.starts_with(name + "::")) left.push_back(instance);
    }
    scene_.engine().set_instances(std::move(left));
    core_.renew_handles();
    return {};
  }
  if (name == "ground")
    return Status::refused("the ground belongs to the world; write `ground: false` in a world file");
  Entity entity;
  const Status found = find_entity(scene_, name, entity);
  return found ? Status::refused(fmt::format("'{}' is part of an entity and cannot be deleted alone", name))
               : found;
}

Status EntityServices::set_pose(const std::string& name, const geometry_msgs::msg::Pose& pose) {
  return set_state(name, "", pose, {});
}

Status EntityServices::get_state(const std::string& name, const std::string& reference,
                                 geometry_msgs::msg::Pose& pose, geometry_msgs::msg::Twist& twist) const {
  Entity entity;
  EntityMotion frame;
  if (const Status found = find_entity(scene_, name, entity); !found) return found;
  if (const Status found = find_frame(scene_, reference, frame); !found) return found;
  const EntityMotion motion = motion_of(scene_, entity);
  const Eigen::Matrix3d R_FW = frame.X_WE.linear().transpose();
  pose = to_pose_msg(frame.X_WE.inverse() * motion.X_WE);
  twist.linear = to_vector_msg(R_FW * (motion.velocity.linear_W - frame.velocity.linear_W));
  twist.angular = to_vector_msg(R_FW * (motion.velocity.angular_W - frame.velocity.angular_W));
  return {};
}

Status EntityServices::set_state(const std::string& name, const std::string& reference,
                                 const geometry_msgs::msg::Pose& pose,
                                 const geometry_msgs::msg::Twist& twist) {
  Entity entity;
  EntityMotion frame;
  if (const Status found = find_entity(scene_, name, entity); !found) return found;
  if (const Status found = find_frame(scene_, reference, frame); !found) return found;
  const ModelInstance& made = scene_.instance(entity.body.instance).made_of();
  if (entity.robot && !(made.floating() && entity.body.link == made.base_link())) {
    return Status::refused(
        fmt::format("'{}' is a robot with a fixed base or a link of a robot; its joints are set with "
                    "/gazebo/set_state",
                    name));
  }
  if (entity.body.link != made.base_link()) {
    return Status::refused(
        fmt::format("'{}' is a link that joints carry; move the object that it belongs to", name));
  }
  for (const Attachment& of : scene_.engine().attachments()) {
    const BodyId& other = of.a.instance == entity.body.instance ? of.b : of.a;
    if (of.a.instance == entity.body.instance || of.b.instance == entity.body.instance)
      return Status::refused(fmt::format("'{}' is attached to '{}'; detach it first", name,
                                         scene_.engine().world().name_of(other)));
  }
  Pose X_WE;
  if (const Status valid = place_in(reference, pose, X_WE); !valid) return valid;
  const Eigen::Matrix3d R_WF = frame.X_WE.linear();
  const FrameVelocity velocity{R_WF * from_msg(twist.linear), R_WF * from_msg(twist.angular)};
  if (const Status near = near_enough(X_WE); !near) return near;
  if (!(velocity.linear_W.norm() <= kMaxEntitySpeed) || !(velocity.angular_W.norm() <= kMaxEntitySpeed))
    return Status::refused(
        fmt::format("the twist is not finite, or faster than {:g} m/s or rad/s", kMaxEntitySpeed));
  move(entity, {X_WE, velocity});
  return {};
}

// Moves an object so that its frame or its shape has the requested pose and velocity.
void EntityServices::move(const Entity& entity, EntityMotion motion) {
  Instance object = scene_.instance(entity.body.instance);
  const Pose X_WB = motion.X_WE * entity.X_BE.inverse();
  motion.velocity.linear_W += motion.velocity.angular_W.cross(X_WB.translation() - motion.X_WE.translation());
  motion.X_WE = X_WB;
  object.place(motion.X_WE);
  if (!motion.velocity.linear_W.isZero(0) || !motion.velocity.angular_W.isZero(0))
    object.set_base_velocity(motion.velocity);
  core_.renew_handles();
}

// Logged once, also if a client repeats the call.
void EntityServices::log_refusal(const std::string& service, const Status& status) {
  if (status.ok() || status.why() == last_error_) return;
  last_error_ = status.why();
  log_.warning("gazebo", fmt::format("{}: {}", service, last_error_));
}

void EntityServices::advertise_spawning() {
  using gazebo_msgs::srv::DeleteEntity;
  using gazebo_msgs::srv::SpawnEntity;
  node_.serve<SpawnEntity>(
      "spawn_entity", [this](const SpawnEntity::Request& r, const Responder<SpawnEntity::Response>& respond) {
        Spawned what{r.name, r.xml, r.robot_namespace};
        const auto done = [respond](const Status& status, const std::string& good) {
          respond(answer<SpawnEntity::Response>(status, good));
        };
        const Status placed = place_in(r.reference_frame, r.initial_pose, what.X_WE);
        if (!placed) return done(placed, "");
        spawn(std::move(what), done);
      });
  node_.serve<DeleteEntity>(
      "delete_entity", [this](const DeleteEntity::Request& r, Responder<DeleteEntity::Response> respond) {
        const Status status = remove(r.name);
        respond(answer<DeleteEntity::Response>(status, fmt::format("'{}' is deleted", r.name)));
      });
}

void EntityServices::offer_entity_state() {
  using gazebo_msgs::srv::GetEntityState;
  using gazebo_msgs::srv::SetEntityState;
  node_.serve<GetEntityState>("~/get_entity_state", [this](const GetEntityState::Request& r,
                                                           Responder<GetEntityState::Response> respond) {
    GetEntityState::Response response;
    const Status status = get_state(r.name, r.reference_frame, response.state.pose, response.state.twist);
    response.success = status.ok();
    response.header.stamp = to_time_msg(node_.bus().stamp(scene_.now()));
    response.header.frame_id = is_world(r.reference_frame) ? "world" : r.reference_frame;
    response.state.name = r.name;
    response.state.reference_frame = response.header.frame_id;
    log_refusal("get_entity_state", status);
    respond(response);
  });
  node_.serve<SetEntityState>("~/set_entity_state", [this](const SetEntityState::Request& r,
                                                           Responder<SetEntityState::Response> respond) {
    const Status status = set_state(r.state.name, r.state.reference_frame, r.state.pose, r.state.twist);
    log_refusal("set_entity_state", status);
    respond({status.ok()});
  });
}

void EntityServices::offer_model_state() {
  using gazebo_msgs::srv::GetModelState;
  using gazebo_msgs::srv::SetModelState;
  node_.serve<GetModelState>("~/get_model_state", [this](const GetModelState::Request& r,
                                                         Responder<GetModelState::Response> respond) {
    GetModelState::Response found;
    const std::string first = scene_.robots().empty() ? "" : scene_.instance(scene_.robots().front()).name();
    const Status status = get_state(r.model_name.empty() ? first : r.model_name, r.relative_entity_name,
                                    found.pose, found.twist);
    auto response = answer<GetModelState::Response>(status, "");
    response.header.stamp = to_time_msg(node_.bus().stamp(scene_.now()));
    response.header.frame_id = is_world(r.relative_entity_name) ? "world" : r.relative_entity_name;
    response.pose = found.pose;
    response.twist = found.twist;
    respond(response);
  });
  node_.serve<SetModelState>("~/set_model_state", [this](const SetModelState::Request& r,
                                                         Responder<SetModelState::Response> respond) {
    const auto& state = r.model_state;
    respond(answer<SetModelState::Response>(
        set_state(state.model_name, state.reference_frame, state.pose, state.twist), "set"));
  });
}

}  // namespace doppel
