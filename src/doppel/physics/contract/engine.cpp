#include "doppel/physics/contract/engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "doppel/physics/contract/engine_modules.h"
#include "doppel/physics/contract/exclusions.h"
#include "doppel/robot/collision/lowest_point.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

const std::string kGroundName = "ground";

// z of the lowest point of the instance's shapes in the world, m; infinite: it has none.
double lowest_point(const ModelInstance& instance, const Pose& X_WR, const Eigen::VectorXd& q) {
  Data data(*instance.model);
  forward_kinematics(*instance.model, data, q);
  return lowest_point(instance.shapes, [&](std::size_t link) -> Pose { return X_WR * data.X_WL[link]; });
}

// Moves a floating base along the world's z until its lowest point is on the ground. False: there is no
// floating base, or it need not move.
bool raise_base(const ModelInstance& instance, const Pose& X_WR, bool only_out_of_ground,
                Eigen::VectorXd& q) {
  if (!instance.floating()) return false;
  const double lowest = lowest_point(instance, X_WR, q);
  if (!std::isfinite(lowest) || (only_out_of_ground && lowest >= -kOverlap)) return false;
  const ModelJoint& joint = instance.model->joints.front();
  const Eigen::Vector3d up = (X_WR.linear() * joint.X_PJ.linear()).transpose() * Eigen::Vector3d::UnitZ();
  q.segment<3>(joint.q) -= lowest * up;
  return true;
}

void refuse_name(const ModelInstance& instance) {
  throw InputError("world.name_taken", instance.description->source,
                   instance.name == kGroundName
                       ? "the name 'ground' is reserved for the ground"
                       : fmt::format("the world already has an object named '{}'", instance.name),
                   "choose another name");
}

}  // namespace

// -- the compiled world

CompiledWorld::CompiledWorld(WorldSettings settings, std::vector<ModelInstance> instances)
    : settings_(std::move(settings)), instances_(std::move(instances)) {
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    ModelInstance& instance = instances_[i];
    if (instance.name == kGroundName || static_cast<std::size_t>(find(instance.name)) != i)
      refuse_name(instance);
    if (!instance.set_on_ground || !settings_.ground) continue;
    const bool placed = !instance.X_WR.isApprox(Pose::Identity());
    raise_base(instance, instance.X_WR, placed, instance.q0);
    instance.set_on_ground = false;  // it stands there now, also after a further compilation
  }
}

const std::string& CompiledWorld::name_of(BodyId body) const {
  if (body.is_ground()) return kGroundName;
  const ModelInstance& instance = instances_.at(static_cast<std::size_t>(body.instance));
  return instance.is_object() ? instance.name
                              : instance.model->links.at(static_cast<std::size_t>(body.link)).name;
}

// -- the handle

namespace {

// Separate from the check, because the loop makes the check for each joint of each step.
[[noreturn, gnu::cold]] void refuse_joint(const std::string& instance, int joint) {
  throw std::out_of_range(fmt::format("'{}' has no scalar joint {}", instance, joint));
}

}  // namespace

const ModelInstance& Instance::made_of() const {
  return engine_->world().instances()[static_cast<std::size_t>(index_)];
}

int Instance::checked_joint(int joint) const {
  const auto& joints = model().joints;
  if (joint < 0 || joint >= static_cast<int>(joints.size()) ||
      !joints[static_cast<std::size_t>(joint)].scalar())
    refuse_joint(name(), joint);
  return joint;
}

int Instance::checked_drive(int joint) const {
  if (model().joints[static_cast<std::size_t>(checked_joint(joint))].mimics())
    throw std::out_of_range(
        fmt::format("joint {} of '{}' mimics another joint and has no drive", joint, name()));
  return joint;
}

int Instance::checked_link(int link) const {
  if (link < 0 || link >= static_cast<int>(model().links.size()))
    throw std::out_of_range(fmt::format("'{}' has no link {}", name(), link));
  return link;
}

std::span<const double> Instance::q() const {
  return engine_->q_of(index_);
}
std::span<const double> Instance::v() const {
  return engine_->v_of(index_);
}
std::span<const double> Instance::drive_effort() const {
  return engine_->drive_effort_of(index_);
}

void Instance::set_state(std::span<const double> q, std::span<const double> v) {
  if (q.size() != static_cast<std::size_t>(model().nq) || v.size() != static_cast<std::size_t>(model().nv))
    throw std::out_of_range(fmt::format("a state of '{}' has {} positions and {} velocities, not {} and {}",
                                        name(), model().nq, model().nv, q.size(), v.size()));
  engine_->write_state(index_, q, v);
  engine_->carry_attached(index_);
}

const Pose& Instance::root_pose() const {
  return engine_->root_pose_of(index_);
}
void Instance::set_root_pose(const Pose& X_WR) {
  engine_->write_root_pose(index_, X_WR);
  engine_->carry_attached(index_);
}

void Instance::place(const Pose& X_WB) {
  if (!made_of().floating()) return set_root_pose(X_WB);
  engine_->write_base(index_, X_WB);
  engine_->carry_attached(index_);
}

void Instance::set_base_velocity(const FrameVelocity& velocity) {
  if (!made_of().floating()) return;
  const ModelJoint& joint = model().joints.front();
  const Eigen::VectorXd positions = Eigen::Map<const Eigen::VectorXd>(q().data(), model().nq);
  Eigen::VectorXd rates = Eigen::Map<const Eigen::VectorXd>(v().data(), model().nv);
  rates.segment<3>(joint.v) = (root_pose() * joint.X_PJ).linear().transpose() * velocity.linear_W;
  rates.segment<3>(joint.v + 3) = base_pose().linear().transpose() * velocity.angular_W;
  set_state({positions.data(), static_cast<std::size_t>(positions.size())},
            {rates.data(), static_cast<std::size_t>(rates.size())});
}

void Instance::lift_out_of_ground() {
  if (!engine_->world().settings().ground) return;
  Eigen::VectorXd raised = Eigen::Map<const Eigen::VectorXd>(q().data(), model().nq);
  if (!raise_base(made_of(), root_pose(), true, raised)) return;
  const std::vector<double> moving(v().begin(), v().end());
  set_state({raised.data(), static_cast<std::size_t>(raised.size())}, moving);
}

void Instance::set_drive(int joint, DriveMode mode) {
  engine_->start_drive(index_, checked_drive(joint), mode);
}
DriveState Instance::drive_state(int joint) const {
  return engine_->drive_of(index_, checked_joint(joint));
}
void Instance::set_target(int joint, double target) {
  engine_->write_target(index_, checked_drive(joint), target);
}
void Instance::set_servo(int joint, const ServoParameters& servo) {
  engine_->write_servo(index_, checked_drive(joint), servo);
}
void Instance::set_drive_reference(int joint, double reference) {
  engine_->write_reference(index_, checked_drive(joint), reference);
}
void Instance::apply_joint_effort(int joint, double effort) {
  engine_->write_joint_effort(index_, checked_joint(joint), effort);
}
void Instance::apply_wrench(int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                            const Eigen::Vector3d& torque_W) {
  engine_->write_wrench(index_, checked_link(link), p_LoP_L, force_W, torque_W);
}
Pose Instance::link_pose(int link) const {
  return engine_->pose_of(index_, checked_link(link));
}
FrameVelocity Instance::link_velocity(int link) const {
  return engine_->velocity_of(index_, checked_link(link));
}

// -- the state

Instance Engine::instance(int index) {
  if (index < 0 || index >= static_cast<int>(world_->instances().size()))
    throw std::out_of_range(fmt::format("the world has no instance {}", index));
  return {*this, index};
}

// The const functions of a handle do not change the engine, so the cast is safe.
const Instance Engine::instance(int index) const {
  return const_cast<Engine*>(this)->instance(index);
}

std::optional<Instance> Engine::find(std::string_view name) {
  const int index = world_->find(name);
  return index < 0 ? std::nullopt : std::optional<Instance>(instance(index));
}

std::optional<const Instance> Engine::find(std::string_view name) const {
  const int index = world_->find(name);
  return index < 0 ? std::nullopt : std::optional<const Instance>(instance(index));
}

void Engine::set_instances(std::vector<ModelInstance> instances) {
  Diagnostics notes;  // repeats what was reported when the instances were made
  continue_with(world_->with(std::move(instances), notes));
}

void Engine::continue_with(std::shared_ptr<const CompiledWorld> world) {
  std::vector<int> kept;
  for (const ModelInstance& instance : world->instances()) {
    const int before = world_->find(instance.name);
    const bool same =
        before >= 0 && world_->instances()[static_cast<std::size_t>(before)].model == instance.model;
    kept.push_back(same ? before : -1);
  }
  // Attachments of instances that stay, by their new indices.
  std::vector<Attachment> attached;
  const auto renumbered = [&kept](BodyId& body) {
    if (body.is_ground()) return true;
    const auto found = std::ranges::find(kept, body.instance);
    body.instance = static_cast<int>(found - kept.begin());
    return found != kept.end();
  };
  for (Attachment attachment : attachments_) {
    if (renumbered(attachment.a) && renumbered(attachment.b)) attached.push_back(attachment);
  }
  become(std::move(world), kept);
  attachments_ = std::move(attached);
  if (!attachments_.empty()) apply_attachments();
}

// -- attachments

Pose Engine::pose_of(BodyId body) const {
  return body.is_ground() ? Pose(Pose::Identity()) : instance(body.instance).link_pose(body.link);
}

// True if a joint above the link moves.
bool Engine::can_move(BodyId body) const {
  if (body.is_ground()) return false;
  const Model& model = instance(body.instance).model();
  for (int link = body.link; link > 0;) {
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(link - 1)];
    if (joint.nv > 0) return true;
    link = joint.parent_link;
  }
  return false;
}

Status Engine::attach(BodyId a, BodyId b) {
  const Pose X_AB = pose_of(a).inverse() * pose_of(b);
  const auto refused = [&](const char* why) {
    return Status::refused(fmt::format("'{}' and '{}' {}", world_->name_of(a), world_->name_of(b), why));
  };
  if (!world_->capabilities().attachments)
    return Status::refused(
        fmt::format("the engine {} cannot attach bodies to each other; start with --engine {}",
                    world_->capabilities().name, kDefaultEngine));
  if (a.instance == b.instance) return refused("belong to the same model");
  if (!can_move(a) && !can_move(b)) return refused("are both fixed to the world");
  if (std::ranges::any_of(attachments_, [&](const Attachment& of) { return of.joins(a, b); }))
    return refused("are attached already");
  attachments_.push_back({a, b, X_AB});
  apply_attachments();
  return {};
}

bool Engine::detach(BodyId a, BodyId b) {
  if (std::erase_if(attachments_, [&](const Attachment& of) { return of.joins(a, b); }) == 0) return false;
  apply_attachments();
  return true;
}

// Writes the state of a floating instance at rest, with its base link at a pose.
void Engine::write_base(int index, const Pose& X_WB) {
  const Model& model = instance(index).model();
  const ModelJoint& joint = model.joints.front();
  const Pose X_JB = (root_pose_of(index) * joint.X_PJ).inverse() * X_WB;
  Eigen::VectorXd state = Eigen::Map<const Eigen::VectorXd>(q_of(index).data(), model.nq);
  state.segment<3>(joint.q) = X_JB.translation();
  state.segment<4>(joint.q + 3) = Eigen::Quaterniond(X_JB.linear()).coeffs();
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(model.nv);
  write_state(index, {state.data(), static_cast<std::size_t>(state.size())},
              {rest.data(), static_cast<std::size_t>(rest.size())});
}

// Places what is attached to an instance whose state was written, and what is attached to that: each
// instance once, because attachments can form a ring.
void Engine::carry_attached(int index) {
  constexpr double kInPlace = 1e-9;
  if (attachments_.empty()) return;
  std::vector<bool> placed(world_->instances().size());
  placed[static_cast<std::size_t>(index)] = true;
  std::vector<int> carriers{index};
  for (std::size_t i = 0; i < carriers.size(); ++i) {
    for (const Attachment& of : attachments_) {
      const bool forwards = of.a.instance == carriers[i];
      if (!forwards && of.b.instance != carriers[i]) continue;
      const BodyId carrier = forwards ? of.a : of.b, body = forwards ? of.b : of.a;
      if (body.is_ground() || placed[static_cast<std::size_t>(body.instance)]) continue;
      const Instance carried = instance(body.instance);
      if (!carried.made_of().floating()) continue;
      placed[static_cast<std::size_t>(body.instance)] = true;
      const Pose X_WL = pose_of(carrier) * (forwards ? of.X_AB : of.X_AB.inverse());
      if (X_WL.isApprox(pose_of(body), kInPlace)) continue;
      write_base(body.instance, X_WL * pose_of(body).inverse() * carried.base_pose());
      carriers.push_back(body.instance);
    }
  }
}

void Engine::spawn(ModelInstance instance) {
  std::vector<ModelInstance> instances = world_->instances();
  instances.push_back(std::move(instance));
  set_instances(std::move(instances));
}

bool Engine::remove(std::string_view name) {
  const int index = world_->find(name);
  if (index < 0) return false;
  std::vector<ModelInstance> instances = world_->instances();
  instances.erase(instances.begin() + index);
  set_instances(std::move(instances));
  return true;
}

}  // namespace doppel
