#include "doppel/physics/mujoco/mujoco_engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "doppel/kinematics/dynamics.h"
#include "doppel/physics/mujoco/convert.h"
#include "doppel/physics/mujoco/mujoco_engine_detail.h"

namespace doppel {
namespace {

Eigen::Map<const Eigen::Vector3d> vector_at(const double* p) {
  return Eigen::Map<const Eigen::Vector3d>(p);
}

Eigen::Matrix3d rotation_at(const double* row_major) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row_major);
}

}  // namespace

void MujocoEngine::make_drives(const EngineOptions& options) {
  const Eigen::Vector3d gravity_R = world_.X_WR.linear().transpose() * world_.gravity;
  servos_ = options.servos.empty() ? choose_servos(model_, {}, gravity_R) : options.servos;
  if (servos_.size() != model_.joints.size())
    throw std::invalid_argument("EngineOptions::servos has the wrong size");
  const bool ideal =
      std::any_of(servos_.begin(), servos_.end(), [](const ServoParameters& s) { return s.ideal; });
  if (ideal && step_scheme(world_.integrator).order > 1) {
    throw InputError(
        "physics.ideal_scheme", {},
        fmt::format("ideal servos land on their reference within one step of euler; {} is no such "
                    "integrator",
                    name_of(world_.integrator)),
        "leave `integrator` out of the world, or the servos as they are");
  }
  const Eigen::VectorXd carried =
      ideal ? carried_inertia(model_)
            : Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model_.joints.size())).eval();
  drive_of_joint_.assign(model_.joints.size(), -1);
  for (const int joint : robot_.driven) {
    drive_of_joint_[joint] = static_cast<int>(drives_.size());
    drives_.emplace_back(joint, servos_[joint], carried[joint], world_.step);
  }
}

void MujocoEngine::reset() {
  mj_resetData(m(), d());
  for (std::size_t i = 0; i < world_.objects.size(); ++i) state_->place_object(i, world_.objects[i].X_WO);
  lift_wrenches();
  std::fill(applied_effort_.begin(), applied_effort_.end(), 0.0);
  diverged_ = false;
  steps_ = 0;
  std::fill(rotors_.begin(), rotors_.end(), 0.0);
  for (Drive& drive : drives_) drive.start(DriveMode::limp, 0.0);
  for (JointSpring& spring : springs_) spring.on = false;
  scheme_ = &step_scheme(world_.integrator);
  write_armature();
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(model_.nv);
  set_state({q0_.data(), static_cast<std::size_t>(model_.nq)},
            {rest.data(), static_cast<std::size_t>(model_.nv)});
}

void MujocoEngine::set_state(std::span<const double> q, std::span<const double> v) {
  q_ = Eigen::Map<const Eigen::VectorXd>(q.data(), model_.nq);
  model_.apply_mimics(q_);
  state_->write_q(model_, q_.data());
  std::copy_n(v.data(), model_.nv, d()->qvel);
  for (const ModelJoint& joint : model_.joints) {
    if (joint.mimics()) d()->qvel[joint.v] = joint.mimic_multiplier * v[model_.joints[joint.mimic_leader].v];
  }
  std::fill_n(d()->qacc_warmstart, m()->nv, 0.0);
  std::fill(effort_.begin(), effort_.end(), 0.0);
  for (Drive& drive : drives_) drive.follow(q_[model_.joints[drive.joint()].q]);
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    springs_[k].bound = 0;
    if (k >= drives_.size()) springs_[k].on = false;  // what was touched before is not what is touched now
  }
  diverged_ = !state_->refresh() || ran_away();
}

void MujocoEngine::set_drive(int joint, DriveMode mode) {
  const int index = drive_of_joint_[joint];
  const ModelJoint& of = model_.joints[joint];
  drives_[index].start(mode, d()->qpos[of.q]);
  springs_[index].bound = 0;
  rotors_[of.v] = mode == DriveMode::effort ? servos_[joint].rotor_inertia : 0.0;
  if (mode == DriveMode::limp) effort_[joint] = 0.0;
}

void MujocoEngine::clear_applied() {
  std::fill(applied_effort_.begin(), applied_effort_.end(), 0.0);
  std::fill_n(d()->xfrc_applied, 6 * m()->nbody, 0.0);
  lift_wrenches();
}

void MujocoEngine::lift_wrenches() {
  for (auto* wrenches : {&wrenches_, &object_wrenches_}) {
    for (AppliedWrench& wrench : *wrenches) wrench.on = false;
  }
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
  for (std::size_t i = 0; i < wrenches_.size(); ++i)
    add_wrench(state_->body_of_link(static_cast<int>(i)), wrenches_[i]);
  for (std::size_t i = 0; i < object_wrenches_.size(); ++i)
    add_wrench(state_->object(i).body, object_wrenches_[i]);
  for (std::size_t i = 0; any_weightless_ && i < model_.links.size(); ++i) {
    const ModelLink& link = model_.links[i];
    if (!link.weightless || !link.inertia) continue;
    add_wrench(state_->body_of_link(static_cast<int>(i)),
               {true, link.inertia->com, -link.inertia->mass * world_.gravity, Eigen::Vector3d::Zero()});
  }
}

Pose MujocoEngine::body_pose(int body) const {
  Pose X = Pose::Identity();
  X.linear() = rotation_at(d()->xmat + 9 * body);
  X.translation() = vector_at(d()->xpos + 3 * body);
  return X;
}

FrameVelocity MujocoEngine::body_velocity(int body) const {
  double rotation_then_translation[6];
  mj_objectVelocity(m(), d(), mjOBJ_XBODY, body, rotation_then_translation, 0);
  return {vector_at(rotation_then_translation + 3), vector_at(rotation_then_translation)};
}

// MuJoCo's own would count the armature, which no mass stands behind, and links without gravity.
MujocoEngine::Energy MujocoEngine::energy() const {
  double potential = 0.0, kinetic = 0.0;
  for (int body = 1; body < m()->nbody; ++body)
    potential -= m()->body_mass[body] * world_.gravity.dot(vector_at(d()->xipos + 3 * body));
  for (std::size_t i = 0; any_weightless_ && i < model_.links.size(); ++i) {
    const ModelLink& link = model_.links[i];
    if (!link.weightless || !link.inertia) continue;
    potential += link.inertia->mass * world_.gravity.dot(link_pose(static_cast<int>(i)) * link.inertia->com);
  }
  mj_mulM(m(), d(), momentum_.data(), d()->qvel);
  for (int v = 0; v < m()->nv; ++v) {
    const double armature = v < model_.nv ? m()->dof_armature[v] : 0.0;
    kinetic += 0.5 * d()->qvel[v] * (momentum_[v] - armature * d()->qvel[v]);
  }
  return {potential, kinetic};
}

Contact MujocoEngine::describe(const mjContact& contact) const {
  Contact out;
  const int body_a = m()->geom_bodyid[contact.geom1], body_b = m()->geom_bodyid[contact.geom2];
  const auto name = [&](int body, int link) -> std::string_view {
    const int object = state_->object_of_body(body);
    if (link >= 0) return "";
    return object >= 0 ? std::string_view(world_.objects[object].name) : "ground";
  };
  out.link_a = state_->link_of_body(body_a);
  out.link_b = state_->link_of_body(body_b);
  out.object_a = name(body_a, out.link_a);
  out.object_b = name(body_b, out.link_b);
  out.p_W = vector_at(contact.pos);
  out.normal_W = vector_at(contact.frame);
  out.depth = -contact.dist;
  return out;
}

void MujocoEngine::contacts(std::vector<Contact>& out) const {
  // The forces of this instant are only solved for in the next step; a copy is asked, so that looking changes
  // nothing.
  if (looked_ == nullptr) looked_.reset(mj_makeData(m()));
  mjData* const c = mj_copyData(looked_.get(), m(), d());
  out.clear();
  write_present_efforts(*c);
  if (!guarded([this, c] {
        mj_fwdAcceleration(m(), c);
        mj_fwdConstraint(m(), c);
      })) {
    return;
  }
  for (int i = 0; i < c->ncon; ++i) {
    Contact contact = describe(c->contact[i]);
    double force[6];
    mj_contactForce(m(), c, i, force);
    contact.force_W = rotation_at(c->contact[i].frame).transpose() * vector_at(force);
    out.push_back(contact);
  }
}

RayHit MujocoEngine::cast_ray(const Eigen::Vector3d& from_W, const Eigen::Vector3d& direction_W) const {
  RayHit hit;
  const double length = direction_W.norm();
  if (!(length > 0)) return hit;
  const Eigen::Vector3d direction = direction_W / length;
  int geom = -1;
  hit.distance = mj_ray(m(), d(), from_W.data(), direction.data(), nullptr, 1, -1, &geom);
  if (geom >= 0) hit.link = state_->link_of_body(m()->geom_bodyid[geom]);
  return hit;
}

namespace {

const MujocoEngine& mujoco(const Engine& engine) {
  return dynamic_cast<const MujocoEngine&>(engine);
}

}  // namespace

std::unique_ptr<Engine> make_mujoco_engine(const RobotDescription& robot, const Model& model,
                                           const World& world, const EngineOptions& options,
                                           Diagnostics& diagnostics) {
  return std::make_unique<MujocoEngine>(robot, model, world, options, diagnostics);
}

double measure_bare_step_rate(const Engine& engine, int steps) {
  const MujocoEngine& at = mujoco(engine);
  const DataHandle copy(mj_copyData(nullptr, at.m(), at.d()));
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < steps; ++i) {
    at.write_present_efforts(*copy);
    mj_step(at.m(), copy.get());
  }
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  return steps / taken.count();
}

void mujoco_inverse_dynamics(const Engine& engine, std::span<const double> acceleration,
                             std::span<double> tau) {
  const MujocoEngine& at = mujoco(engine);
  const DataHandle copy(mj_copyData(nullptr, at.m(), at.d()));
  std::fill_n(copy->qacc, at.m()->nv, 0.0);
  std::copy(acceleration.begin(), acceleration.end(), copy->qacc);
  mj_inverse(at.m(), copy.get());
  for (std::size_t v = 0; v < tau.size(); ++v) {
    tau[v] = copy->qfrc_inverse[v] - at.m()->dof_armature[v] * copy->qacc[v] +
             at.joint_damping_effort(static_cast<int>(v));
  }
}

}  // namespace doppel
