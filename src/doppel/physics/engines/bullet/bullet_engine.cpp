#include "doppel/physics/engines/bullet/bullet_engine.h"

#include <algorithm>
#include <stdexcept>

#include "doppel/physics/contract/engine_modules.h"

namespace doppel {
namespace {

void start(InstanceState& state, const BulletInstance& compiled, const ModelInstance& instance) {
  const Model& model = *instance.model;
  const auto nv = static_cast<std::size_t>(model.nv);
  state.X_WR = instance.X_WR;
  state.q.assign(instance.q0.data(), instance.q0.data() + instance.q0.size());
  state.v.assign(nv, 0.0);
  state.applied.assign(nv, 0.0);
  state.rotors.assign(nv, 0.0);
  state.effort.assign(model.joints.size(), 0.0);
  state.wrenches.assign(model.links.size(), {});
  state.drives = compiled.drives;
  state.springs = compiled.springs;
  for (std::size_t k = 0; k < state.drives.size(); ++k)
    state.rotors[static_cast<std::size_t>(state.springs[k].v)] = state.drives[k].rotor();
}

}  // namespace

BulletEngine::BulletEngine(std::shared_ptr<const BulletWorld> world)
    : Engine(world), states_(world->compiled().size()), solver_(std::make_unique<StepSolver>(*world)) {
  reset();
}

std::unique_ptr<Engine> BulletEngine::clone() const {
  auto out = std::make_unique<BulletEngine>(std::static_pointer_cast<const BulletWorld>(compiled()));
  out->copy_state(*this);
  return out;
}

void BulletEngine::copy_state(const Engine& from) {
  if (from.compiled() != compiled())
    throw std::invalid_argument("a state can be copied only between engines of the same compiled world");
  const auto& other = static_cast<const BulletEngine&>(from);
  if (this == &other) return;
  states_ = other.states_;
  diverged_ = other.diverged_;
  steps_ = other.steps_;
  load_all();
}

// The constraint solver leaves its intermediate velocities in the bodies.
void BulletEngine::load_all() const {
  for (std::size_t i = 0; i < states_.size(); ++i) solver_->load(static_cast<int>(i), states_[i]);
}

void BulletEngine::reset() {
  for (int i = 0; i < static_cast<int>(states_.size()); ++i) reset(i);
  diverged_ = false;
  steps_ = 0;
}

void BulletEngine::reset(int instance) {
  const ModelInstance& of = world().instances()[static_cast<std::size_t>(instance)];
  InstanceState& state = at(instance);
  start(state, bullet_world().compiled()[static_cast<std::size_t>(instance)], of);
  Eigen::Map<Eigen::VectorXd> q(state.q.data(), of.model->nq);
  of.model->apply_mimics(q);
  for (Drive& drive : state.drives)
    drive.start(
        DriveMode::passive,
        state.q[static_cast<std::size_t>(of.model->joints[static_cast<std::size_t>(drive.joint())].q)]);
  solver_->load(instance, state);
}

namespace {

void advance_drives(std::vector<InstanceState>& states) {
  for (InstanceState& state : states) {
    for (std::size_t k = 0; k < state.drives.size(); ++k) {
      state.drives[k].advance(state.q[static_cast<std::size_t>(state.springs[k].q)],
                              state.v[static_cast<std::size_t>(state.springs[k].v)]);
      state.drives[k].write_law(state.springs[k]);
    }
  }
}

}  // namespace

void BulletEngine::step() {
  if (diverged_) return;
  advance_drives(states_);
  if (solver_->solve(states_)) {
    solver_->integrate(states_);
    ++steps_;
  } else {
    diverged_ = true;
  }
  load_all();
}

// Solves the next step in a copy. With the law of the last step, a drive that moves its reference would lag,
// and a wheel that spins would carry less than its load.
void BulletEngine::contacts(std::vector<Contact>& out) const {
  std::vector<InstanceState> copy = states_;
  advance_drives(copy);
  if (solver_->solve(copy)) {
    solver_->contacts(out);
  } else {
    out.clear();
  }
  load_all();
}

RayHit BulletEngine::cast_ray(const Eigen::Vector3d& from_W, const Eigen::Vector3d& direction_W) const {
  return solver_->cast_ray(from_W, direction_W, states_);
}

void BulletEngine::become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) {
  auto fresh = std::static_pointer_cast<const BulletWorld>(std::move(world));
  auto solver = std::make_unique<StepSolver>(*fresh);
  std::vector<InstanceState> states(kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] >= 0) states[i] = at(kept[i]);
  }
  world_ = fresh;
  solver_ = std::move(solver);
  states_ = std::move(states);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] >= 0) {
      solver_->load(static_cast<int>(i), states_[i]);
    } else {
      reset(static_cast<int>(i));
    }
  }
}

void BulletEngine::write_state(int instance, std::span<const double> q, std::span<const double> v) {
  InstanceState& state = at(instance);
  const Model& model = *world().instances()[static_cast<std::size_t>(instance)].model;
  std::copy(q.begin(), q.end(), state.q.begin());
  std::copy(v.begin(), v.end(), state.v.begin());
  Eigen::Map<Eigen::VectorXd> positions(state.q.data(), model.nq);
  model.apply_mimics(positions);
  for (const ModelJoint& joint : model.joints) {
    if (joint.mimics())
      state.v[static_cast<std::size_t>(joint.v)] =
          joint.mimic_multiplier *
          v[static_cast<std::size_t>(model.joints[static_cast<std::size_t>(joint.mimic_leader)].v)];
    if (joint.type == JointType::floating) positions.segment<4>(joint.q + 3).normalize();
  }
  std::fill(state.effort.begin(), state.effort.end(), 0.0);
  for (std::size_t k = 0; k < state.springs.size(); ++k) {
    JointSpring& spring = state.springs[k];
    spring.bound = 0;
    if (k < state.drives.size()) {
      state.drives[k].follow(state.q[static_cast<std::size_t>(spring.q)]);
    } else {
      spring.on = false;  // contact with a stop before the change of state does not continue after it
    }
  }
  diverged_ = !std::ranges::all_of(state.q, [](double x) { return std::isfinite(x); }) ||
              !std::ranges::all_of(state.v, [](double x) { return std::isfinite(x); });
  solver_->load(instance, state);
}

void BulletEngine::write_root_pose(int instance, const Pose& X_WR) {
  at(instance).X_WR = X_WR;
  solver_->load(instance, at(instance));
}

const Drive* BulletEngine::find_drive(int instance, int joint) const {
  const int index = bullet_world()
                        .compiled()[static_cast<std::size_t>(instance)]
                        .drive_of_joint[static_cast<std::size_t>(joint)];
  return index < 0 ? nullptr : &at(instance).drives[static_cast<std::size_t>(index)];
}

Drive& BulletEngine::drive_at(int instance, int joint) {
  const int index = bullet_world()
                        .compiled()[static_cast<std::size_t>(instance)]
                        .drive_of_joint[static_cast<std::size_t>(joint)];
  return at(instance).drives[static_cast<std::size_t>(index)];
}

void BulletEngine::start_drive(int instance, int joint, DriveMode mode) {
  InstanceState& state = at(instance);
  Drive& drive = drive_at(instance, joint);
  JointSpring& spring = state.springs[static_cast<std::size_t>(&drive - state.drives.data())];
  drive.start(mode, state.q[static_cast<std::size_t>(spring.q)]);
  spring.bound = 0;
  state.rotors[static_cast<std::size_t>(spring.v)] = drive.rotor();
  if (mode == DriveMode::passive) state.effort[static_cast<std::size_t>(joint)] = 0.0;
}

DriveState BulletEngine::drive_of(int instance, int joint) const {
  const Drive* const drive = find_drive(instance, joint);
  return drive == nullptr ? DriveState{} : drive->state();
}
void BulletEngine::write_target(int instance, int joint, double target) {
  drive_at(instance, joint).set_target(target);
}
void BulletEngine::write_servo(int instance, int joint, const ServoParameters& servo) {
  drive_at(instance, joint).set_servo(servo);
}
void BulletEngine::write_reference(int instance, int joint, double reference) {
  drive_at(instance, joint).follow(reference);
}

void BulletEngine::write_joint_effort(int instance, int joint, double effort) {
  const Model& model = *world().instances()[static_cast<std::size_t>(instance)].model;
  at(instance).applied[static_cast<std::size_t>(model.joints[static_cast<std::size_t>(joint)].v)] = effort;
}

void BulletEngine::write_wrench(int instance, int link, const Eigen::Vector3d& p_LoP_L,
                                const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) {
  at(instance).wrenches[static_cast<std::size_t>(link)] = {true, p_LoP_L, force_W, torque_W};
}

void BulletEngine::clear_applied() {
  for (InstanceState& state : states_) {
    std::fill(state.applied.begin(), state.applied.end(), 0.0);
    for (LinkWrench& wrench : state.wrenches) wrench.on = false;
  }
}

Pose BulletEngine::pose_of(int instance, int link) const {
  return solver_->link_pose(instance, link, at(instance));
}
FrameVelocity BulletEngine::velocity_of(int instance, int link) const {
  return solver_->link_velocity(instance, link);
}

}  // namespace doppel
