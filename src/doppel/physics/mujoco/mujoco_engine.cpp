#include "doppel/physics/mujoco/mujoco_engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "doppel/core/names.h"
#include "doppel/kinematics/dynamics.h"
#include "doppel/physics/mujoco/convert.h"
#include "doppel/physics/mujoco/drive.h"
#include "doppel/physics/mujoco/mujoco_state_detail.h"

namespace doppel {
namespace {

struct AppliedWrench {
  bool on = false;
  Eigen::Vector3d p_LoP_L, force_W, torque_W;
};

constexpr int kRunaway[] = {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC};

Eigen::Map<const Eigen::Vector3d> vector_at(const double* p) {
  return Eigen::Map<const Eigen::Vector3d>(p);
}

Eigen::Matrix3d rotation_at(const double* row_major) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row_major);
}

class MujocoEngine final : public Engine {
 public:
  MujocoEngine(const RobotDescription& robot, const Model& model, const World& world,
               const EngineOptions& options, Diagnostics& diagnostics)
      : model_(model),
        world_(world),
        robot_(write_robot(robot, model, world, meshes_, diagnostics)),
        state_(std::make_unique<MujocoState>(robot_, model, world, meshes_, diagnostics)),
        q0_(options.q0.size() > 0 ? options.q0 : model.neutral()),
        q_(model.nq),
        effort_(model.joints.size(), 0.0),
        wrenches_(model.links.size()) {
    if (q0_.size() != model.nq) throw std::invalid_argument("EngineOptions::q0 has the wrong size");
    floating_ = std::any_of(model.joints.begin(), model.joints.end(),
                            [](const ModelJoint& joint) { return joint.type == JointType::floating; });
    make_drives(options);
    choose_exclusions(options.self_collision);
    reset();
  }

  [[nodiscard]] EngineCapabilities capabilities() const override {
    const int version = mj_version();
    const int minor_base = version >= 1000 ? 1000000 : 100;  // 222 is 2.2.2; from 3.5 on 3005000 is 3.5.0
    const int minor_unit = version >= 1000 ? 1000 : 10;
    return {fmt::format("mujoco {}.{}.{}", version / minor_base, version % minor_base / minor_unit,
                        version % minor_unit),
            true, true, true};
  }
  [[nodiscard]] const std::vector<ExcludedPair>& excluded_pairs() const override { return excluded_; }
  [[nodiscard]] std::span<const ServoParameters> servos() const override { return servos_; }

  void reset() override;
  void step() override;
  [[nodiscard]] Time time() const override { return steps_ * world_.step; }
  void set_time(Time now) override { steps_ = now / world_.step; }
  [[nodiscard]] bool diverged() const override { return diverged_; }

  [[nodiscard]] std::span<const double> q() const override {
    return {floating_ ? q_.data() : d()->qpos, static_cast<std::size_t>(model_.nq)};
  }
  [[nodiscard]] std::span<const double> v() const override {
    return {d()->qvel, static_cast<std::size_t>(model_.nv)};
  }
  [[nodiscard]] std::span<const double> drive_effort() const override { return effort_; }
  void set_state(std::span<const double> q, std::span<const double> v) override;

  void set_drive(int joint, DriveMode mode) override;
  [[nodiscard]] DriveMode drive(int joint) const override {
    return drive_of_joint_[joint] < 0 ? DriveMode::limp : drives_[drive_of_joint_[joint]].mode();
  }
  void set_target(int joint, double target) override { drives_[drive_of_joint_[joint]].set_target(target); }

  [[nodiscard]] double drive_reference(int joint) const override {
    return drives_[drive_of_joint_[joint]].reference();
  }
  void set_drive_reference(int joint, double reference) override {
    drives_[drive_of_joint_[joint]].follow(reference);
  }

  void apply_joint_effort(int joint, double effort) override {
    d()->qfrc_applied[model_.joints[joint].v] = effort;
  }
  void apply_wrench(int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                    const Eigen::Vector3d& torque_W) override {
    wrenches_[link] = {true, p_LoP_L, force_W, torque_W};
    any_wrench_ = true;
  }
  void clear_applied() override;

  [[nodiscard]] Pose link_pose(int link) const override { return body_pose(state_->body_of_link(link)); }
  [[nodiscard]] double kinetic_energy() const override;
  [[nodiscard]] double potential_energy() const override;

  void contacts(std::vector<Contact>& out) const override;
  [[nodiscard]] RayHit cast_ray(const Eigen::Vector3d& from_W,
                                const Eigen::Vector3d& direction_W) const override;
  bool object_pose(std::string_view name, Pose& X_WO) const override;
  bool set_object_pose(std::string_view name, const Pose& X_WO) override;
  void spawn(const WorldObject& object) override;
  bool remove(std::string_view name) override;

  [[nodiscard]] mjModel* m() const { return state_->m(); }
  [[nodiscard]] mjData* d() const { return state_->d(); }

 private:
  void make_drives(const EngineOptions& options);
  void write_drive(std::size_t actuator);
  void choose_exclusions(bool self_collision);
  void find_touching();
  void write_wrenches();
  void advance();
  bool ran_away() const;
  Pose body_pose(int body) const;
  int find_object(std::string_view name) const;
  Contact describe(const mjContact& contact) const;
  void rebuild(World world);
  void carry_over(const MujocoState& old, const World& old_world, MujocoState& fresh,
                  const World& world) const;

  Model model_;
  World world_;
  CollisionMeshes meshes_;
  RobotMjcf robot_;
  std::unique_ptr<MujocoState> state_;
  mutable DataHandle looked_;  // a copy for questions whose answers need computing; made when first asked
  std::vector<ExcludedPair> excluded_;
  std::vector<ServoParameters> servos_;  // [joints]
  std::vector<Drive> drives_;            // [actuators]
  std::vector<int> drive_of_joint_;      // [joints]; -1: none
  Eigen::VectorXd q0_;
  Eigen::VectorXd q_;                    // the model's q where MuJoCo's differs from it
  bool floating_ = false;                // it does
  std::vector<double> effort_;           // [joints]
  std::vector<double> kept_;             // MuJoCo's qpos and qvel before the step
  std::vector<AppliedWrench> wrenches_;  // [links]
  bool any_wrench_ = false;
  bool diverged_ = false;
  std::int64_t steps_ = 0;
};

void MujocoEngine::make_drives(const EngineOptions& options) {
  const Eigen::Vector3d gravity_R = world_.X_WR.linear().transpose() * world_.gravity;
  servos_ = options.servos.empty() ? choose_servos(model_, {}, gravity_R) : options.servos;
  if (servos_.size() != model_.joints.size())
    throw std::invalid_argument("EngineOptions::servos has the wrong size");
  const bool ideal =
      std::any_of(servos_.begin(), servos_.end(), [](const ServoParameters& s) { return s.ideal; });
  if (ideal && world_.integrator == Integrator::rk4) {
    throw InputError("physics.ideal_explicit", {},
                     "ideal servos need the implicit integrator; rk4 would make them run away",
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

void MujocoEngine::write_drive(std::size_t actuator) {
  const Drive& drive = drives_[actuator];
  m()->actuator_gainprm[mjNGAIN * actuator] = drive.gain();
  m()->actuator_biasprm[mjNBIAS * actuator + 1] = -drive.stiffness();
  m()->actuator_biasprm[mjNBIAS * actuator + 2] = -drive.damping();
  const double effort = drive.servo().effort;
  m()->actuator_forcelimited[actuator] = std::isfinite(effort) ? 1 : 0;
  m()->actuator_forcerange[2 * actuator] = -effort;
  m()->actuator_forcerange[2 * actuator + 1] = effort;
}

void MujocoEngine::choose_exclusions(bool self_collision) {
  for (LinkPair& pair : robot_.pairs) {
    if (pair.reason.empty() && !self_collision) pair.reason = "self-collision is off";
  }
  find_touching();
  state_->apply_exclusions(robot_.pairs);
  for (const LinkPair& pair : robot_.pairs) {
    if (pair.reason.empty()) continue;
    excluded_.push_back({model_.links[pair.a].name, model_.links[pair.b].name, pair.reason});
  }
  const std::vector<int> groups = rigid_groups(model_);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (groups[i] != 0 || !robot_.has_shape[i]) continue;
    if (world_.ground) excluded_.push_back({model_.links[i].name, "ground", "fixed to the world"});
    for (const WorldObject& object : world_.objects) {
      if (!(object.mass > 0))
        excluded_.push_back({model_.links[i].name, object.name, "both fixed to the world"});
    }
  }
}

// Links that touch at the start are shaped so, as a hull that fills a hollow; they would push each other for
// ever.
void MujocoEngine::find_touching() {
  state_->apply_exclusions(robot_.pairs);
  state_->write_q(model_, q0_.data());
  if (!guarded([this] {
        mj_kinematics(m(), d());
        mj_comPos(m(), d());
        mj_collision(m(), d());
      })) {
    return;
  }
  for (int i = 0; i < d()->ncon; ++i) {
    const int a = state_->link_of_body(m()->geom_bodyid[d()->contact[i].geom1]);
    const int b = state_->link_of_body(m()->geom_bodyid[d()->contact[i].geom2]);
    for (LinkPair& pair : robot_.pairs) {
      if (pair.a == std::min(a, b) && pair.b == std::max(a, b)) pair.reason = "touching at the start";
    }
  }
}

void MujocoEngine::reset() {
  mj_resetData(m(), d());
  for (std::size_t i = 0; i < world_.objects.size(); ++i) state_->place_object(i, world_.objects[i].X_WO);
  for (AppliedWrench& wrench : wrenches_) wrench.on = false;
  any_wrench_ = false;
  diverged_ = false;
  steps_ = 0;
  kept_.resize(static_cast<std::size_t>(m()->nq + m()->nv));
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    drives_[k].start(DriveMode::limp, 0.0);
    write_drive(k);
  }
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
  diverged_ = !state_->refresh() || ran_away();
}

void MujocoEngine::set_drive(int joint, DriveMode mode) {
  const int actuator = drive_of_joint_[joint];
  drives_[actuator].start(mode, d()->qpos[model_.joints[joint].q]);
  write_drive(static_cast<std::size_t>(actuator));
  if (mode == DriveMode::limp) effort_[joint] = 0.0;
}

void MujocoEngine::clear_applied() {
  std::fill_n(d()->qfrc_applied, model_.nv, 0.0);
  std::fill_n(d()->xfrc_applied, 6 * m()->nbody, 0.0);
  for (AppliedWrench& wrench : wrenches_) wrench.on = false;
  any_wrench_ = false;
}

// MuJoCo takes wrenches at the body's centre of mass.
void MujocoEngine::write_wrenches() {
  for (std::size_t link = 0; link < wrenches_.size(); ++link) {
    const AppliedWrench& wrench = wrenches_[link];
    if (!wrench.on) continue;
    const int body = state_->body_of_link(static_cast<int>(link));
    const Eigen::Vector3d arm = body_pose(body) * wrench.p_LoP_L - vector_at(d()->xipos + 3 * body);
    double* out = d()->xfrc_applied + 6 * body;
    Eigen::Map<Eigen::Vector3d>(out, 3) = wrench.force_W;
    Eigen::Map<Eigen::Vector3d>(out + 3, 3) = wrench.torque_W + arm.cross(wrench.force_W);
  }
}

// mj_step in its two halves, the second first: what depends on positions and velocities is then of the new
// instant.
void MujocoEngine::advance() {
  if (m()->opt.integrator == mjINT_RK4) {
    mj_step(m(), d());
  } else {
    mj_step2(m(), d());
  }
  mj_step1(m(), d());
}

bool MujocoEngine::ran_away() const {
  for (const int warning : kRunaway) {
    if (d()->warning[warning].number > 0) return true;
  }
  return false;
}

void MujocoEngine::step() {
  if (diverged_) return;
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    d()->ctrl[k] = drives_[k].advance(d()->actuator_length[k]);
  }
  if (any_wrench_) write_wrenches();
  const auto nq = static_cast<std::size_t>(m()->nq), nv = static_cast<std::size_t>(m()->nv);
  std::copy_n(d()->qpos, nq, kept_.data());
  std::copy_n(d()->qvel, nv, kept_.data() + nq);
  if (!guarded([this] { advance(); }) || ran_away()) {
    // MuJoCo has set itself back to its zero pose; the state before the step is the last that means
    // something.
    diverged_ = true;
    d()->pstack = 0;  // given up in the middle of a call
    std::copy_n(kept_.data(), nq, d()->qpos);
    std::copy_n(kept_.data() + nq, nv, d()->qvel);
    return;
  }
  ++steps_;
  for (std::size_t k = 0; k < drives_.size(); ++k) effort_[drives_[k].joint()] = d()->actuator_force[k];
  if (floating_) state_->read_q(model_, q_.data());
}

Pose MujocoEngine::body_pose(int body) const {
  Pose X = Pose::Identity();
  X.linear() = rotation_at(d()->xmat + 9 * body);
  X.translation() = vector_at(d()->xpos + 3 * body);
  return X;
}

double MujocoEngine::kinetic_energy() const {
  mj_energyVel(m(), d());
  return d()->energy[1];
}

double MujocoEngine::potential_energy() const {
  mj_energyPos(m(), d());
  return d()->energy[0];
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
  if (!guarded([this, c] {
        mj_fwdActuation(m(), c);
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

int MujocoEngine::find_object(std::string_view name) const {
  for (std::size_t i = 0; i < world_.objects.size(); ++i) {
    if (world_.objects[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

bool MujocoEngine::object_pose(std::string_view name, Pose& X_WO) const {
  const int index = find_object(name);
  if (index < 0) return false;
  X_WO = body_pose(state_->object(index).body);
  return true;
}

bool MujocoEngine::set_object_pose(std::string_view name, const Pose& X_WO) {
  const int index = find_object(name);
  if (index < 0) return false;
  state_->place_object(static_cast<std::size_t>(index), X_WO);
  if (!state_->refresh()) diverged_ = true;
  return true;
}

void MujocoEngine::spawn(const WorldObject& object) {
  if (find_object(object.name) >= 0 || object.name == "ground") {
    throw InputError("world.name_taken", object.source,
                     fmt::format("the world already has an object named '{}'", object.name),
                     "choose another name");
  }
  World world = world_;
  world.objects.push_back(object);
  rebuild(std::move(world));
}

bool MujocoEngine::remove(std::string_view name) {
  const int index = find_object(name);
  if (index < 0) return false;
  World world = world_;
  world.objects.erase(world.objects.begin() + index);
  rebuild(std::move(world));
  return true;
}

void MujocoEngine::rebuild(World world) {
  Diagnostics notes;
  auto fresh = std::make_unique<MujocoState>(robot_, model_, world, meshes_, notes);
  fresh->apply_exclusions(robot_.pairs);
  carry_over(*state_, world_, *fresh, world);
  looked_.reset();
  state_ = std::move(fresh);
  world_ = std::move(world);
  kept_.resize(static_cast<std::size_t>(m()->nq + m()->nv));
  for (std::size_t k = 0; k < drives_.size(); ++k) write_drive(k);
  if (!state_->refresh()) diverged_ = true;
}

void MujocoEngine::carry_over(const MujocoState& old, const World& old_world, MujocoState& fresh,
                              const World& world) const {
  const mjData* from = old.d();
  mjData* to = fresh.d();
  std::copy_n(from->qpos, model_.nq, to->qpos);
  std::copy_n(from->qvel, model_.nv, to->qvel);
  std::copy_n(from->qacc_warmstart, model_.nv, to->qacc_warmstart);
  std::copy_n(from->qfrc_applied, model_.nv, to->qfrc_applied);
  std::copy_n(from->ctrl, old.m()->nu, to->ctrl);
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    const MujocoObject& object = fresh.object(i);
    fresh.place_object(i, world.objects[i].X_WO);
    for (std::size_t k = 0; k < old_world.objects.size(); ++k) {
      if (old_world.objects[k].name != world.objects[i].name) continue;
      const MujocoObject& before = old.object(k);
      std::copy_n(old.m()->body_pos + 3 * before.body, 3, fresh.m()->body_pos + 3 * object.body);
      std::copy_n(old.m()->body_quat + 4 * before.body, 4, fresh.m()->body_quat + 4 * object.body);
      if (object.q < 0) continue;
      std::copy_n(from->qpos + before.q, 7, to->qpos + object.q);
      std::copy_n(from->qvel + before.v, 6, to->qvel + object.v);
      std::copy_n(from->qacc_warmstart + before.v, 6, to->qacc_warmstart + object.v);
    }
  }
}

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
  for (int i = 0; i < steps; ++i) mj_step(at.m(), copy.get());
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
  std::copy_n(copy->qfrc_inverse, tau.size(), tau.begin());
}

}  // namespace doppel
