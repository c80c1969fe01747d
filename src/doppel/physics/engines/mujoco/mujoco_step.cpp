// The integration of a step: the W-method of step_scheme.h over MuJoCo's forward dynamics. The armature that
// makes springs and dampers implicit is part of the matrix with which MuJoCo solves constraints, so friction,
// mimics, limits and contacts are solved consistently with the step.

#include <algorithm>
#include <cmath>

#include "doppel/physics/contract/detail/gyroscopic.h"
#include "doppel/physics/engines/mujoco/mujoco_engine.h"
#include "doppel/physics/mjcf/mjcf.h"

namespace doppel {

// The inertia that the joint moves, including its mimics and the joints that drives hold, kg m^2 or kg.
double MujocoEngine::moved_inertia(const CompiledStop& stop) {
  double out = 0.0;
  for (const auto& [v, rate] : stop.moved) out += rate * rate * inertia_at(v);
  return out;
}

double MujocoEngine::inertia_at(int v) {
  std::vector<double>&unit = k_v_[0], &response = k_q_[0];
  std::fill(unit.begin(), unit.end(), 0.0);
  unit[v] = 1.0;
  mj_solveM(m(), d(), response.data(), unit.data(), 1);
  return std::max(1.0 / response[v] - m()->dof_armature[v], 0.0);
}

// `index`: of the compiled stops.
void MujocoEngine::meet_stop(std::size_t index) {
  const CompiledStop& compiled = compiled_world().stops[index];
  JointSpring& stop = springs_[drives_.size() + index];
  if (doppel::meet_stop(stop, d()->qpos[stop.q]))
    hit_stop(stop, compiled.restitution, moved_inertia(compiled), to_seconds(settings().step));
}

// Contacts among objects and the ground are ignored: only a robot's motion determines the scheme.
bool MujocoEngine::robot_touches() const {
  const auto of_robot = [this](int geom) {
    const BodyId body = compiled_world().body_of(m()->geom_bodyid[geom]);
    return !body.is_ground() && !compiled_world().instance(body.instance).is_object();
  };
  for (int i = 0; i < d()->ncon; ++i) {
    if (of_robot(d()->contact[i].geom1) || of_robot(d()->contact[i].geom2)) return true;
  }
  return false;
}

void MujocoEngine::begin_step() {
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    drives_[k].advance(d()->qpos[springs_[k].q], d()->qvel[springs_[k].v]);
    drives_[k].write_law(springs_[k]);
  }
  bool stopped = false;
  for (std::size_t k = drives_.size(); k < springs_.size(); ++k) {
    meet_stop(k - drives_.size());
    stopped = stopped || springs_[k].on;
  }
  // Contacts and stops are one-sided springs that may be stiffer than the step resolves: several evaluations
  // are then not more accurate.
  const StepScheme& wanted = step_scheme(settings().integrator);
  scheme_ = stopped || compiled_world().bounces.impacts(*m(), *d()) || (wanted.order == 2 && robot_touches())
                ? &step_scheme(Integrator::euler)
                : &wanted;
  std::copy_n(d()->qpos, m()->nq, kept_.data());
  std::copy_n(d()->qvel, m()->nv, kept_.data() + m()->nq);
  std::copy_n(d()->qacc_warmstart, m()->nv, kept_.data() + m()->nq + m()->nv);
}

// True: the armature has changed since the mass matrix was computed.
bool MujocoEngine::write_armature() {
  const std::vector<double>& joint_damping = compiled_world().joint_damping;
  std::copy(joint_damping.begin(), joint_damping.end(), linear_damping_.begin());
  std::fill(linear_stiffness_.begin(), linear_stiffness_.end(), 0.0);
  for (const JointSpring& spring : springs_) {
    if (!spring.acts_linearly()) continue;
    linear_damping_[spring.v] += spring.damping;
    if (!scheme_->semi_implicit) linear_stiffness_[spring.v] += spring.stiffness;
  }
  const double h = to_seconds(settings().step) * scheme_->diagonal;
  bool changed = false;
  for (int v = 0; v < m()->nv; ++v) {
    const double armature = rotors_[v] + h * (linear_damping_[v] + h * linear_stiffness_[v]);
    changed = changed || armature != m()->dof_armature[v];
    m()->dof_armature[v] = armature;
  }
  return changed;
}

void MujocoEngine::restore_kept() {
  std::copy_n(kept_.data(), m()->nq, d()->qpos);
  std::copy_n(kept_.data() + m()->nq, m()->nv, d()->qvel);
}

// Moves MuJoCo's q and v from the step's start by the weighted derivatives of the first `stages` stages.
void MujocoEngine::move_by(const std::array<double, kMaxStages>& weights, int stages) {
  const double h = to_seconds(settings().step);
  restore_kept();
  std::fill(move_.begin(), move_.end(), 0.0);
  for (int j = 0; j < stages; ++j) {
    for (int v = 0; v < m()->nv; ++v) {
      move_[v] += weights[j] * k_q_[j][v];
      d()->qvel[v] += h * weights[j] * k_v_[j][v];
    }
  }
  mj_integratePos(m(), d()->qpos, move_.data(), h);
}

// Sets MuJoCo's q and v of stage `i` and computes all that depends on them.
void MujocoEngine::enter_stage(int i) {
  move_by(scheme_->alpha[i], i);
  compute_contacts_and_constraints(m(), d(), compiled_world().contact_rules, compiled_world().bounces,
                                   islands_, i == 0);
  if (any_wrench_ || !compiled_world().weightless.empty()) write_wrenches();
}

bool MujocoEngine::implicit_at(int v) const {
  return linear_damping_[v] != 0 || linear_stiffness_[v] != 0;
}

// The right side of stage i: external efforts, springs, and the terms of J from the earlier stages and,
// because positions move with gamma, from this one.
void MujocoEngine::write_stage_efforts(int i) {
  const double h = to_seconds(settings().step), t = h * scheme_->time(i);
  const double drift = scheme_->semi_implicit ? 0.0 : h * scheme_->gamma_sum(i);
  const double *const q = d()->qpos, *const qvel = d()->qvel;
  const std::vector<double>& joint_damping = compiled_world().joint_damping;
  double* const out = d()->qfrc_applied;
  for (int v = 0; v < m()->nv; ++v) {
    double rate = qvel[v];
    out[v] = applied_effort_[v] - joint_damping[v] * qvel[v];
    if (implicit_at(v)) {
      for (int j = 0; j < i; ++j) {
        const double g = h * scheme_->gamma[i][j];
        rate += g * k_v_[j][v];
        out[v] -= g * (linear_damping_[v] * k_v_[j][v] + linear_stiffness_[v] * k_q_[j][v]);
      }
      out[v] -= h * scheme_->diagonal * linear_stiffness_[v] * rate;
    }
    k_q_[i][v] = rate;
  }
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    const JointSpring& spring = springs_[k];
    if (!spring.on) continue;
    const double asked =
        spring.law(q[spring.q], qvel[spring.v], t) + drift * spring.stiffness * spring.reference_rate;
    asked_[k] += scheme_->b[i] * asked;
    out[spring.v] += spring.bound == 0 ? asked : spring.effort_at_bound();
  }
  if (scheme_->semi_implicit && settings().integrator != Integrator::implicit) add_gyroscopic_corrections();
}

void MujocoEngine::add_gyroscopic_corrections() {
  for (const LooseBody& of : compiled_world().loose) {
    const Eigen::Map<const Eigen::Vector3d> moments(m()->body_inertia + 3 * of.body), w(d()->qvel + of.turn);
    const Eigen::Quaterniond axes = quaternion_from_mujoco(m()->body_iquat + 4 * of.body);
    const Eigen::Vector3d torque =
        gyroscopic_correction(moments, axes.conjugate() * w, to_seconds(settings().step));
    Eigen::Map<Eigen::Vector3d>(d()->qfrc_applied + of.turn) += axes * torque;
  }
}

bool MujocoEngine::solve_stage(int i) {
  mj_fwdAcceleration(m(), d());
  std::copy_n(d()->efc_aref, d()->nefc, references_.data());
  islands_.solve(*m(), *d());
  const double h = to_seconds(settings().step) * scheme_->diagonal;
  bool sane = true;
  for (int v = 0; v < m()->nv; ++v) {
    const double a = d()->qacc[v];
    sane = sane && std::abs(a) < mjMAXVAL;
    k_v_[i][v] = a;
    if (scheme_->semi_implicit || implicit_at(v)) k_q_[i][v] += h * a;
  }
  std::copy_n(d()->qacc, m()->nv, d()->qacc_warmstart);
  if (i > 0) pull_back_turns(i);
  return sane;
}

// The angular velocities of the stages of a freely rotating body are in different axes and cannot be
// summed; the rates of one rotation vector from the step's start can: theta' = w + theta x w / 2 + theta x
// (theta x w) / 12 (Munthe-Kaas, Applied Numerical Mathematics 29, 1999; further terms are of higher order
// than the schemes).
void MujocoEngine::pull_back_turns(int i) {
  const double h = to_seconds(settings().step);
  for (const int v : compiled_world().turning) {
    Eigen::Vector3d theta = Eigen::Vector3d::Zero();
    for (int j = 0; j < i; ++j) theta += h * scheme_->alpha[i][j] * Eigen::Map<Eigen::Vector3d>(&k_q_[j][v]);
    Eigen::Map<Eigen::Vector3d> rate(&k_q_[i][v]);
    const Eigen::Vector3d turn = theta.cross(rate);
    rate += 0.5 * turn + theta.cross(turn) / 12.0;
  }
}

// The effort of spring k over the step if it had no bounds.
double MujocoEngine::asked_effort(std::size_t k) const {
  const JointSpring& spring = springs_[k];
  const double h = to_seconds(settings().step);
  const double stiffness = scheme_->semi_implicit ? 0.0 : spring.stiffness;
  double out = asked_[k];
  for (int i = 0; i < scheme_->stages; ++i) {
    for (int j = 0; j <= i; ++j) {
      out -= scheme_->b[i] * h * scheme_->gamma[i][j] *
             (spring.damping * k_v_[j][spring.v] + stiffness * k_q_[j][spring.v]);
    }
  }
  return out;
}

void MujocoEngine::read_wanted() {
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    if (springs_[k].on) wanted_[k] = asked_effort(k);
  }
}

// False: a spring has met or left a bound, and the step has to be repeated.
bool MujocoEngine::settle(int pass) {
  read_wanted();
  return !rebound(springs_, wanted_, pass);
}

// False: the step diverged.
bool MujocoEngine::take_stages() {
  for (int pass = 0;; ++pass) {
    std::fill(asked_.begin(), asked_.end(), 0.0);
    // A repeated step is that of a first pass for the instances whose springs did not change.
    std::copy_n(kept_.data() + m()->nq + m()->nv, m()->nv, d()->qacc_warmstart);
    const bool changed = write_armature();
    for (int i = 0; i < scheme_->stages; ++i) {
      if (i > 0 || changed || (pass > 0 && scheme_->stages > 1)) {
        enter_stage(i);
      } else if (pass > 0) {
        std::copy_n(references_.data(), d()->nefc, d()->efc_aref);
      }
      write_stage_efforts(i);
      if (!solve_stage(i)) return false;
    }
    if (settle(pass)) return true;
  }
}

void MujocoEngine::finish_step() {
  const double h = to_seconds(settings().step);
  if (settings().integrator == Integrator::implicit) {
    mj_step2(m(), d());  // solves once more, and then with M - h dC/dv
    for (int v = 0; v < m()->nv; ++v) k_v_[0][v] = (d()->qvel[v] - kept_[m()->nq + v]) / h;
    read_wanted();
  } else {
    move_by(scheme_->b, scheme_->stages);
    d()->time += h;
  }
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    const JointSpring& spring = springs_[k];
    effort_[spring.joint] = !spring.on          ? 0.0
                            : spring.bound != 0 ? spring.effort_at_bound()
                                                : std::clamp(wanted_[k], spring.low, spring.high);
  }
  compute_contacts_and_constraints(m(), d(), compiled_world().contact_rules, compiled_world().bounces,
                                   islands_);
}

// After a step that diverged. MuJoCo may have reset itself to its zero pose; the state before the step is the
// last valid one, and poses of bodies and contacts, which clients read, are computed from it again.
void MujocoEngine::leave_at_last_state() {
  diverged_ = true;
  d()->pstack = 0;  // the error may have left a call with the stack in use
  restore_kept();
  std::copy_n(kept_.data() + m()->nq + m()->nv, m()->nv, d()->qacc_warmstart);
  std::fill_n(d()->qacc, m()->nv, 0.0);
  for (const int warning : kRunaway) d()->warning[warning].number = 0;
  static_cast<void>(refresh());
}

void MujocoEngine::step() {
  if (diverged_) return;
  begin_step();
  if (any_wrench_ || !compiled_world().weightless.empty()) write_wrenches();
  bool sane = false;
  const bool whole = guarded([this, &sane] {
    sane = take_stages() && !ran_away();
    if (sane) finish_step();
  });
  if (!whole || !sane || ran_away()) {
    leave_at_last_state();
    return;
  }
  ++steps_;
  read_q();
}

// The efforts at the state of `data` with which a step from there would begin.
void MujocoEngine::write_present_efforts(mjData& data) const {
  double* const out = data.qfrc_applied;
  for (int v = 0; v < m()->nv; ++v)
    out[v] = applied_effort_[v] - compiled_world().joint_damping[v] * data.qvel[v];
  for (std::size_t k = 0; k < springs_.size(); ++k) {
    JointSpring spring = springs_[k];
    if (k < drives_.size()) drives_[k].write_law(spring);
    if (!spring.on) continue;
    const double asked = spring.law(data.qpos[spring.q], data.qvel[spring.v], to_seconds(settings().step));
    out[spring.v] += std::clamp(asked, spring.low, spring.high);
  }
}

}  // namespace doppel
