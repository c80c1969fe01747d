#include "doppel/physics/engines/mujoco/mujoco_engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "doppel/physics/mjcf/mjcf.h"

namespace doppel {
namespace {

Eigen::Map<const Eigen::Vector3d> vector_at(const double* p) {
  return Eigen::Map<const Eigen::Vector3d>(p);
}

Eigen::Matrix3d rotation_at(const double* row_major) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row_major);
}

std::size_t size(int n) {
  return static_cast<std::size_t>(n);
}

}  // namespace

// -- state in the model

ModelView::ModelView(const mjModel& shared)
    : shared_(&shared),
      model_(shared),
      armature_(shared.dof_armature, shared.dof_armature + shared.nv),
      positions_(shared.body_pos, shared.body_pos + 3 * shared.nbody),
      rotations_(shared.body_quat, shared.body_quat + 4 * shared.nbody) {
  point();
}

ModelView::ModelView(const ModelView& other)
    : shared_(other.shared_),
      model_(other.model_),
      couplings_(other.couplings_),
      armature_(other.armature_),
      positions_(other.positions_),
      rotations_(other.rotations_) {
  point();
}

ModelView& ModelView::operator=(const ModelView& other) {
  if (this == &other) return *this;
  armature_ = other.armature_;
  positions_ = other.positions_;
  rotations_ = other.rotations_;
  couplings_ = other.couplings_;
  point();
  return *this;
}

// MuJoCo reads its couplings anew at every step, so that they can be added to those of the compiled model.
void ModelView::set_welds(std::span<const Weld> welds, double step) {
  couplings_ = {};
  if (!welds.empty()) {
    const mjModel& m = *shared_;
    Couplings& c = couplings_;
    c.type.assign(m.eq_type, m.eq_type + m.neq);
    c.first.assign(m.eq_obj1id, m.eq_obj1id + m.neq);
    c.second.assign(m.eq_obj2id, m.eq_obj2id + m.neq);
    c.active.assign(m.eq_active, m.eq_active + m.neq);
    c.solref.assign(m.eq_solref, m.eq_solref + mjNREF * m.neq);
    c.solimp.assign(m.eq_solimp, m.eq_solimp + mjNIMP * m.neq);
    c.data.assign(m.eq_data, m.eq_data + mjNEQDATA * m.neq);
    for (const Weld& weld : welds) {
      c.type.push_back(mjEQ_WELD);
      c.first.push_back(weld.a);
      c.second.push_back(weld.b);
      c.active.push_back(1);
      // The same values as for the couplings of mimics (mjcf.cpp).
      c.solref.insert(c.solref.end(), {2.0 * step, 1.0});
      c.solimp.insert(c.solimp.end(), {0.9999, 0.9999, 0.001, 0.5, 2.0});
      // The point in b, the same point in a, the rotation of b in a, the weight of rotations.
      std::array<double, mjNEQDATA> data{};
      Eigen::Map<Eigen::Vector3d>(data.data() + 3) = weld.X_AB.translation();
      quaternion_to_mujoco(Eigen::Quaterniond(weld.X_AB.linear()), data.data() + 6);
      data[10] = 1.0;
      c.data.insert(c.data.end(), data.begin(), data.end());
    }
  }
  point();
}

void ModelView::point() {
  model_.dof_armature = armature_.data();
  model_.body_pos = positions_.data();
  model_.body_quat = rotations_.data();
  const bool own = !couplings_.type.empty();
  model_.neq = own ? static_cast<int>(couplings_.type.size()) : shared_->neq;
  model_.nemax = shared_->nemax + 6 * (model_.neq - shared_->neq);
  model_.eq_type = own ? couplings_.type.data() : shared_->eq_type;
  model_.eq_obj1id = own ? couplings_.first.data() : shared_->eq_obj1id;
  model_.eq_obj2id = own ? couplings_.second.data() : shared_->eq_obj2id;
  model_.eq_active = own ? couplings_.active.data() : shared_->eq_active;
  model_.eq_solref = own ? couplings_.solref.data() : shared_->eq_solref;
  model_.eq_solimp = own ? couplings_.solimp.data() : shared_->eq_solimp;
  model_.eq_data = own ? couplings_.data.data() : shared_->eq_data;
}

// -- making states

MujocoEngine::MujocoEngine(std::shared_ptr<const MujocoWorld> world)
    : Engine(world),
      view_(*world->m()),
      data_(make_data(world->m())),
      islands_(*world->m(), world->islands, world->contact_rules),
      drives_(world->drives),
      springs_(world->springs),
      q_(size(m()->nq)),
      effort_(size(world->joints), 0.0),
      kept_(size(m()->nq + 2 * m()->nv)),
      applied_effort_(size(m()->nv), 0.0),
      rotors_(size(m()->nv), 0.0),
      linear_damping_(size(m()->nv)),
      linear_stiffness_(size(m()->nv)),
      move_(size(m()->nv)),
      references_(size(m()->njmax)),
      momentum_(size(m()->nv)),
      wrenches_(size(m()->nbody)) {
  for (const CompiledStop& stop : world->stops) springs_.push_back(stop.spring);
  asked_.resize(springs_.size());
  wanted_.resize(springs_.size());
  for (int i = 0; i < kMaxStages; ++i) {
    k_q_[i].assign(size(m()->nv), 0.0);
    k_v_[i].assign(size(m()->nv), 0.0);
  }
  roots_.resize(world->instances().size());
  reset();
}

MujocoEngine::MujocoEngine(const MujocoEngine& other)
    : Engine(other),
      view_(other.view_),
      data_(make_data(other.m())),
      islands_(*other.m(), other.compiled_world().islands, other.compiled_world().contact_rules),
      roots_(other.roots_),
      drives_(other.drives_),
      springs_(other.springs_),
      q_(other.q_),
      effort_(other.effort_),
      kept_(other.kept_),
      applied_effort_(other.applied_effort_),
      rotors_(other.rotors_),
      scheme_(other.scheme_),
      linear_damping_(other.linear_damping_),
      linear_stiffness_(other.linear_stiffness_),
      k_q_(other.k_q_),
      k_v_(other.k_v_),
      move_(other.move_),
      references_(other.references_.size()),
      momentum_(other.momentum_),
      asked_(other.asked_),
      wanted_(other.wanted_),
      wrenches_(other.wrenches_),
      any_wrench_(other.any_wrench_),
      diverged_(other.diverged_),
      steps_(other.steps_) {
  copy_data(m(), d(), other.d());
}

std::unique_ptr<Engine> MujocoEngine::clone() const {
  return std::make_unique<MujocoEngine>(*this);
}

// Scratch is not copied, because a step fills it before reading it.
void MujocoEngine::copy_state(const Engine& from) {
  if (from.compiled() != compiled())
    throw std::invalid_argument("a state can be copied only between engines of the same compiled world");
  const auto& other = static_cast<const MujocoEngine&>(from);
  if (this == &other) return;
  view_ = other.view_;
  copy_data(m(), d(), other.d());
  roots_ = other.roots_;
  drives_ = other.drives_;
  springs_ = other.springs_;
  q_ = other.q_;
  effort_ = other.effort_;
  applied_effort_ = other.applied_effort_;
  rotors_ = other.rotors_;
  scheme_ = other.scheme_;
  linear_damping_ = other.linear_damping_;
  linear_stiffness_ = other.linear_stiffness_;
  wrenches_ = other.wrenches_;
  any_wrench_ = other.any_wrench_;
  diverged_ = other.diverged_;
  steps_ = other.steps_;
  attachments_ = other.attachments_;
}

void MujocoEngine::reset() {
  attachments_.clear();
  write_welds();
  mj_resetData(m(), d());
  for (AppliedWrench& wrench : wrenches_) wrench.on = false;
  any_wrench_ = diverged_ = false;
  std::fill(applied_effort_.begin(), applied_effort_.end(), 0.0);
  std::fill(effort_.begin(), effort_.end(), 0.0);
  std::fill(rotors_.begin(), rotors_.end(), 0.0);
  steps_ = 0;
  for (std::size_t i = 0; i < roots_.size(); ++i) {
    const ModelInstance& instance = world().instances()[i];
    std::copy_n(instance.q0.data(), instance.q0.size(),
                q_.begin() + compiled_world().offsets(static_cast<int>(i)).q);
    put_root(static_cast<int>(i), instance.X_WR);
  }
  write_qpos(q_, 0, compiled_world().quaternions, d()->qpos);
  drives_ = compiled_world().drives;  // with the servos as compiled
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    drives_[k].start(DriveMode::passive, q_[size(springs_[k].q)]);
    rotors_[size(springs_[k].v)] = drives_[k].rotor();
  }
  for (JointSpring& spring : springs_) {
    spring.on = false;
    spring.bound = 0;
  }
  scheme_ = &step_scheme(settings().integrator);
  write_armature();
  diverged_ = !refresh() || ran_away();
}

void MujocoEngine::write_welds() {
  std::vector<ModelView::Weld> welds;
  const auto mujoco_body = [this](BodyId body) {
    return body.is_ground() ? 0 : compiled_world().mujoco_body(body.instance, body.link);
  };
  for (const Attachment& of : attachments_) welds.push_back({mujoco_body(of.a), mujoco_body(of.b), of.X_AB});
  view_.set_welds(welds, to_seconds(settings().step));
}

void MujocoEngine::apply_attachments() {
  write_welds();
  if (!refresh()) diverged_ = true;
}

// Computes the quantities that depend only on positions and velocities. False: MuJoCo raised an error.
bool MujocoEngine::refresh() {
  return guarded([this] {
    compute_contacts_and_constraints(m(), d(), compiled_world().contact_rules, compiled_world().bounces,
                                     islands_);
  });
}

bool MujocoEngine::ran_away() const {
  return std::ranges::any_of(kRunaway, [this](int warning) { return d()->warning[warning].number > 0; });
}

std::int64_t MujocoEngine::dropped_contacts() const {
  return d()->warning[mjWARN_CONTACTFULL].number + d()->warning[mjWARN_CNSTRFULL].number;
}

// -- other instances

void MujocoEngine::become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) {
  MujocoEngine fresh(std::static_pointer_cast<const MujocoWorld>(std::move(world)));
  fresh.steps_ = steps_;
  fresh.diverged_ = diverged_;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] >= 0) fresh.carry_over(*this, static_cast<int>(i), kept[i]);
  }
  fresh.write_armature();
  if (!fresh.refresh()) fresh.diverged_ = true;
  *this = std::move(fresh);
}

// Copies the state of the instance `before` of another engine, which has the same model.
void MujocoEngine::carry_over(const MujocoEngine& from, int index, int before) {
  const InstanceOffsets to = compiled_world().offsets(index), old = from.compiled_world().offsets(before);
  const Model& model = *world().instances()[size(index)].model;
  std::copy_n(from.d()->qpos + old.q, model.nq, d()->qpos + to.q);
  std::copy_n(from.q_.begin() + old.q, model.nq, q_.begin() + to.q);
  std::copy_n(from.d()->qvel + old.v, model.nv, d()->qvel + to.v);
  std::copy_n(from.d()->qacc_warmstart + old.v, model.nv, d()->qacc_warmstart + to.v);
  std::copy_n(from.applied_effort_.begin() + old.v, model.nv, applied_effort_.begin() + to.v);
  std::copy_n(from.rotors_.begin() + old.v, model.nv, rotors_.begin() + to.v);
  std::copy_n(from.effort_.begin() + old.joint, model.joints.size(), effort_.begin() + to.joint);
  put_root(index, from.root_pose_of(before));
  for (std::size_t link = 0; link < model.links.size(); ++link) {
    const AppliedWrench& wrench =
        from.wrenches_[size(from.compiled_world().mujoco_body(before, static_cast<int>(link)))];
    wrenches_[size(compiled_world().mujoco_body(index, static_cast<int>(link)))] = wrench;
    any_wrench_ = any_wrench_ || wrench.on;
  }
  // Drives and stops of the same model have the same order.
  std::vector<const JointSpring*> springs;
  for (const JointSpring& spring : from.springs_) {
    if (spring.joint >= old.joint && spring.joint < old.joint + static_cast<int>(model.joints.size()))
      springs.push_back(&spring);
  }
  std::size_t next = 0;
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    JointSpring& spring = springs_[k];
    if (spring.joint < to.joint || spring.joint >= to.joint + static_cast<int>(model.joints.size())) continue;
    const JointSpring place = spring;
    const std::size_t earlier = static_cast<std::size_t>(springs[next] - from.springs_.data());
    spring = *springs[next++];
    spring.joint = place.joint;
    spring.q = place.q;
    spring.v = place.v;
    if (k < drives_.size()) drives_[k] = from.drives_[earlier];
  }
}

// -- one instance

std::span<const double> MujocoEngine::q_of(int instance) const {
  return std::span<const double>(q_).subspan(size(compiled_world().offsets(instance).q),
                                             size(world().instances()[size(instance)].model->nq));
}

std::span<const double> MujocoEngine::v_of(int instance) const {
  return {d()->qvel + compiled_world().offsets(instance).v,
          size(world().instances()[size(instance)].model->nv)};
}

std::span<const double> MujocoEngine::drive_effort_of(int instance) const {
  return std::span<const double>(effort_).subspan(size(compiled_world().offsets(instance).joint),
                                                  world().instances()[size(instance)].model->joints.size());
}

void MujocoEngine::write_state(int instance, std::span<const double> q, std::span<const double> v) {
  const Model& model = *world().instances()[size(instance)].model;
  const InstanceOffsets& at = compiled_world().offsets(instance);
  Eigen::Map<Eigen::VectorXd> own(q_.data() + at.q, model.nq);
  own = Eigen::Map<const Eigen::VectorXd>(q.data(), model.nq);
  model.apply_mimics(own);
  write_qpos(q_of(instance), at.q, compiled_world().quaternions, d()->qpos);
  std::copy(v.begin(), v.end(), d()->qvel + at.v);
  for (const ModelJoint& joint : model.joints) {
    if (joint.mimics())
      d()->qvel[at.v + joint.v] = joint.mimic_multiplier * v[size(model.joints[size(joint.mimic_leader)].v)];
  }
  std::fill_n(d()->qacc_warmstart + at.v, model.nv, 0.0);
  std::fill_n(effort_.begin() + at.joint, model.joints.size(), 0.0);
  const int end = at.joint + static_cast<int>(model.joints.size());
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    JointSpring& spring = springs_[k];
    if (spring.joint < at.joint || spring.joint >= end) continue;
    spring.bound = 0;
    if (k < drives_.size()) {
      drives_[k].follow(q_[size(spring.q)]);
    } else {
      spring.on = false;  // contact with a stop before the change of state does not continue after it
    }
  }
  diverged_ = !refresh() || ran_away();
}

void MujocoEngine::write_root_pose(int instance, const Pose& X_WR) {
  put_root(instance, X_WR);
  if (!refresh()) diverged_ = true;
}

void MujocoEngine::put_root(int instance, const Pose& X_WR) {
  roots_[size(instance)] = X_WR;
  const int body = compiled_world().mujoco_body(instance, 0);
  Eigen::Map<Eigen::Vector3d>(m()->body_pos + 3 * body) = X_WR.translation();
  quaternion_to_mujoco(Eigen::Quaterniond(X_WR.linear()), m()->body_quat + 4 * body);
}

int MujocoEngine::drive_index(int instance, int joint) const {
  return compiled_world().drive_of_joint[size(compiled_world().offsets(instance).joint + joint)];
}

void MujocoEngine::start_drive(int instance, int joint, DriveMode mode) {
  const std::size_t index = size(drive_index(instance, joint));
  JointSpring& spring = springs_[index];
  drives_[index].start(mode, q_[size(spring.q)]);
  spring.bound = 0;
  rotors_[size(spring.v)] = drives_[index].rotor();
  if (mode == DriveMode::passive) effort_[size(spring.joint)] = 0.0;
}

DriveState MujocoEngine::drive_of(int instance, int joint) const {
  const int index = drive_index(instance, joint);
  return index < 0 ? DriveState{} : drives_[size(index)].state();
}
void MujocoEngine::write_target(int instance, int joint, double target) {
  drives_[size(drive_index(instance, joint))].set_target(target);
}
void MujocoEngine::write_servo(int instance, int joint, const ServoParameters& servo) {
  drives_[size(drive_index(instance, joint))].set_servo(servo);
}
void MujocoEngine::write_reference(int instance, int joint, double reference) {
  drives_[size(drive_index(instance, joint))].follow(reference);
}

Pose MujocoEngine::pose_of(int instance, int link) const {
  return body_pose(compiled_world().mujoco_body(instance, link));
}

FrameVelocity MujocoEngine::velocity_of(int instance, int link) const {
  double rotation_then_translation[6];
  mj_objectVelocity(m(), d(), mjOBJ_XBODY, compiled_world().mujoco_body(instance, link),
                    rotation_then_translation, 0);
  return {vector_at(rotation_then_translation + 3), vector_at(rotation_then_translation)};
}

// -- loads

void MujocoEngine::write_joint_effort(int instance, int joint, double effort) {
  const Model& model = *world().instances()[size(instance)].model;
  applied_effort_[size(compiled_world().offsets(instance).v + model.joints[size(joint)].v)] = effort;
}

void MujocoEngine::write_wrench(int instance, int link, const Eigen::Vector3d& p_LoP_L,
                                const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) {
  wrenches_[size(compiled_world().mujoco_body(instance, link))] = {true, p_LoP_L, force_W, torque_W};
  any_wrench_ = true;
}

void MujocoEngine::clear_applied() {
  std::fill(applied_effort_.begin(), applied_effort_.end(), 0.0);
  std::fill_n(d()->xfrc_applied, 6 * m()->nbody, 0.0);
  for (AppliedWrench& wrench : wrenches_) wrench.on = false;
  any_wrench_ = false;
}

// MuJoCo takes wrenches at the body's centre of mass.
void MujocoEngine::add_wrench(int body, const AppliedWrench& wrench) {
  if (!wrench.on) return;
  const Eigen::Vector3d arm = body_pose(body) * wrench.p_BoP_B - vector_at(d()->xipos + 3 * body);
  double* out = d()->xfrc_applied + 6 * body;
  Eigen::Map<Eigen::Vector3d>(out, 3) += wrench.force_W;
  Eigen::Map<Eigen::Vector3d>(out + 3, 3) += wrench.torque_W + arm.cross(wrench.force_W);
}

void MujocoEngine::write_wrenches() {
  std::fill_n(d()->xfrc_applied, 6 * m()->nbody, 0.0);
  for (int body = 1; body < m()->nbody; ++body) add_wrench(body, wrenches_[size(body)]);
  for (const WeightlessBody& of : compiled_world().weightless)
    add_wrench(of.body, {true, of.com, -of.mass * settings().gravity, Eigen::Vector3d::Zero()});
}

// -- reading the whole world

Pose MujocoEngine::body_pose(int body) const {
  Pose X = Pose::Identity();
  X.linear() = rotation_at(d()->xmat + 9 * body);
  X.translation() = vector_at(d()->xpos + 3 * body);
  return X;
}

// MuJoCo's own energy would include links without gravity.
double MujocoEngine::potential_energy() const {
  double out = 0.0;
  for (int body = 1; body < m()->nbody; ++body)
    out -= m()->body_mass[body] * settings().gravity.dot(vector_at(d()->xipos + 3 * body));
  for (const WeightlessBody& of : compiled_world().weightless)
    out += of.mass * settings().gravity.dot(body_pose(of.body) * of.com);
  return out;
}

// MuJoCo's own energy would include the armature, which is not a mass.
double MujocoEngine::kinetic_energy() const {
  double out = 0.0;
  mj_mulM(m(), d(), momentum_.data(), d()->qvel);
  for (int v = 0; v < m()->nv; ++v)
    out += 0.5 * d()->qvel[v] * (momentum_[size(v)] - m()->dof_armature[v] * d()->qvel[v]);
  return out;
}

void MujocoEngine::contacts(std::vector<Contact>& out) const {
  // The forces of this instant are only solved in the next step; they are computed in a copy, so that reading
  // does not change the state.
  out.clear();
  if (looked_ == nullptr) looked_ = make_data(m());
  mjData* const c = looked_.get();
  const bool whole = guarded([this, c] {
    copy_data(m(), c, d());
    write_present_efforts(*c);
    mj_fwdAcceleration(m(), c);
    islands_.solve(*m(), *c);
  });
  if (!whole) return;
  for (int i = 0; i < c->ncon; ++i) {
    Contact contact = compiled_world().describe(c->contact[i]);
    double force[6];
    mj_contactForce(m(), c, i, force);
    const Eigen::Matrix3d R_WC = rotation_at(c->contact[i].frame).transpose();
    contact.force_W = R_WC * vector_at(force);
    contact.torque_W = R_WC * vector_at(force + 3);
    out.push_back(contact);
  }
}

RayHit MujocoEngine::cast_ray(const Eigen::Vector3d& from_W, const Eigen::Vector3d& direction_W) const {
  RayHit hit;
  const double length = direction_W.norm();
  if (!(length > 0)) return hit;
  const Eigen::Vector3d direction = direction_W / length;
  int geom = -1;
  const bool whole = guarded(
      [&] { hit.distance = mj_ray(m(), d(), from_W.data(), direction.data(), nullptr, 1, -1, &geom); });
  if (!whole) return {};
  if (geom >= 0) hit.body = compiled_world().body_of(m()->geom_bodyid[geom]);
  return hit;
}

}  // namespace doppel
