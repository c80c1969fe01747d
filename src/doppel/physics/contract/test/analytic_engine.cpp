#include "analytic_engine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "doppel/physics/contract/detail/joint_springs.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel::test {
namespace {

constexpr int kParts = 50;  // of a step

struct State {
  Pose X_WR = Pose::Identity();
  std::vector<double> q, v, effort, applied, rotors;
  std::vector<Drive> drives;
  std::vector<JointSpring> springs;                         // of the drives
  std::vector<Eigen::Vector3d> p_LoP_L, force_W, torque_W;  // [links]
};

class AnalyticWorld final : public CompiledWorld {
 public:
  AnalyticWorld(WorldSettings settings, std::vector<ModelInstance> instances)
      : CompiledWorld(std::move(settings), std::move(instances)) {}
  [[nodiscard]] const EngineCapabilities& capabilities() const override;
  [[nodiscard]] std::unique_ptr<Engine> make_engine() const override;
  [[nodiscard]] std::shared_ptr<const CompiledWorld> with(std::vector<ModelInstance> instances,
                                                          Diagnostics&) const override {
    return std::make_shared<const AnalyticWorld>(settings(), std::move(instances));
  }
};

class AnalyticEngine final : public Engine {
 public:
  explicit AnalyticEngine(std::shared_ptr<const CompiledWorld> world) : Engine(std::move(world)) { reset(); }
  [[nodiscard]] std::unique_ptr<Engine> clone() const override {
    return std::make_unique<AnalyticEngine>(*this);
  }
  void copy_state(const Engine& from) override {
    if (from.compiled() != compiled()) throw std::invalid_argument("another compilation");
    const auto& other = static_cast<const AnalyticEngine&>(from);
    states_ = other.states_;
    steps_ = other.steps_;
    diverged_ = other.diverged_;
  }
  void reset() override {
    states_.clear();
    for (const ModelInstance& instance : world().instances()) states_.push_back(start(instance));
    steps_ = 0;
    diverged_ = false;
  }
  void step() override {
    if (diverged_) return;
    const std::vector<State> before = states_;
    for (std::size_t i = 0; i < states_.size(); ++i) step(world().instances()[i], states_[i]);
    for (const State& state : states_) {
      for (const double v : state.v) diverged_ = diverged_ || !(std::abs(v) < 1e10);
    }
    if (diverged_) {
      states_ = before;
    } else {
      ++steps_;
    }
  }
  [[nodiscard]] Time time() const override { return Time(steps_ * world().settings().step); }
  void set_time(Time now) override { steps_ = now.time_since_epoch() / world().settings().step; }
  [[nodiscard]] bool diverged() const override { return diverged_; }
  void clear_applied() override {
    for (State& state : states_) {
      std::ranges::fill(state.applied, 0.0);
      std::ranges::fill(state.force_W, Eigen::Vector3d::Zero());
      std::ranges::fill(state.torque_W, Eigen::Vector3d::Zero());
    }
  }
  [[nodiscard]] double kinetic_energy() const override {
    double out = 0;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const Model& model = *world().instances()[i].model;
      Data data(model);
      mass_matrix(model, data, vector(states_[i].q));
      out += 0.5 * vector(states_[i].v).dot(data.M * vector(states_[i].v));
    }
    return out;
  }
  [[nodiscard]] double potential_energy() const override {
    double out = 0;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const Model& model = *world().instances()[i].model;
      for (std::size_t link = 0; link < model.links.size(); ++link) {
        const auto& inertia = model.links[link].inertia;
        if (!inertia || model.links[link].weightless || rigid_to_root(model, static_cast<int>(link)))
          continue;
        const Pose X_WL = pose_of(static_cast<int>(i), static_cast<int>(link));
        out -= inertia->mass * world().settings().gravity.dot(X_WL * inertia->com);
      }
    }
    return out;
  }
  void contacts(std::vector<Contact>& out) const override { out.clear(); }
  [[nodiscard]] RayHit cast_ray(const Eigen::Vector3d&, const Eigen::Vector3d&) const override { return {}; }

 private:
  static Eigen::Map<const Eigen::VectorXd> vector(const std::vector<double>& of) {
    return {of.data(), static_cast<Eigen::Index>(of.size())};
  }
  static bool rigid_to_root(const Model& model, int link) {
    for (int joint = model.links[static_cast<std::size_t>(link)].joint; joint >= 0;
         joint =
             model.links[static_cast<std::size_t>(model.joints[static_cast<std::size_t>(joint)].parent_link)]
                 .joint) {
      if (model.joints[static_cast<std::size_t>(joint)].type != JointType::fixed) return false;
    }
    return true;
  }
  [[nodiscard]] State start(const ModelInstance& instance) const {
    const Model& model = *instance.model;
    State out;
    out.X_WR = instance.X_WR;
    Eigen::VectorXd q = instance.q0;
    model.apply_mimics(q);
    out.q.assign(q.data(), q.data() + q.size());
    out.v.assign(static_cast<std::size_t>(model.nv), 0.0);
    out.applied = out.rotors = out.v;
    out.effort.assign(model.joints.size(), 0.0);
    out.drives = make_drives(instance, world().settings());
    for (Drive& drive : out.drives) {
      out.springs.push_back(spring_of_joint(model, drive.joint()));
      drive.start(DriveMode::passive, out.q[static_cast<std::size_t>(out.springs.back().q)]);
      out.rotors[static_cast<std::size_t>(out.springs.back().v)] = drive.rotor();
    }
    out.p_LoP_L.assign(model.links.size(), Eigen::Vector3d::Zero());
    out.force_W = out.torque_W = out.p_LoP_L;
    return out;
  }
  // v = G u with the velocities u of the joints that are not mimic joints.
  static Eigen::MatrixXd reduction(const Model& model) {
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(model.nv, model.nv);
    for (const ModelJoint& joint : model.joints) {
      if (joint.nv == 0) continue;
      const int from =
          joint.mimics() ? model.joints[static_cast<std::size_t>(joint.mimic_leader)].v : joint.v;
      G(joint.v, from) = joint.mimics() ? joint.mimic_multiplier : 1.0;
    }
    return G;
  }
  [[nodiscard]] Eigen::VectorXd outer_efforts(const ModelInstance& instance, const State& state, Data& data,
                                              const Eigen::VectorXd& q) const {
    const Model& model = *instance.model;
    Eigen::VectorXd out = vector(state.applied);
    forward_kinematics(model, data, q);
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.nv);
    for (std::size_t link = 0; link < model.links.size(); ++link) {
      if (state.force_W[link].isZero(0) && state.torque_W[link].isZero(0)) continue;
      jacobian(model, data, static_cast<int>(link), state.p_LoP_L[link], J);
      const Eigen::Matrix3d R_RW = state.X_WR.linear().transpose();
      out += J.topRows<3>().transpose() * (R_RW * state.torque_W[link]) +
             J.bottomRows<3>().transpose() * (R_RW * state.force_W[link]);
    }
    return out;
  }
  void step(const ModelInstance& instance, State& state) const {
    for (std::size_t k = 0; k < state.drives.size(); ++k) {
      state.drives[k].advance(state.q[static_cast<std::size_t>(state.springs[k].q)],
                              state.v[static_cast<std::size_t>(state.springs[k].v)]);
      state.drives[k].write_law(state.springs[k]);
      state.effort[static_cast<std::size_t>(state.springs[k].joint)] = 0.0;
    }
    for (int part = 0; part < kParts; ++part) part_step(instance, state, part);
  }
  // One short step, implicit in springs and dampers, in which those at a bound are constant.
  void part_step(const ModelInstance& instance, State& state, int part) const {
    const Model& model = *instance.model;
    const double h = to_seconds(world().settings().step) / kParts, t = (part + 1) * h;
    Data data(model);
    Eigen::VectorXd q = vector(state.q), v = vector(state.v);
    const Eigen::Vector3d gravity = state.X_WR.linear().transpose() * world().settings().gravity;
    inverse_dynamics(model, data, q, v, Eigen::VectorXd::Zero(model.nv), gravity);
    const Eigen::VectorXd bias = data.tau;
    mass_matrix(model, data, q);
    const Eigen::MatrixXd M = data.M, G = reduction(model);
    const Eigen::VectorXd outer = outer_efforts(instance, state, data, q);
    std::vector<int> bound(state.springs.size(), 0);
    Eigen::VectorXd fresh = v;
    for (int pass = 0; pass < 8; ++pass) {
      Eigen::MatrixXd A = M;
      Eigen::VectorXd b = M * v + h * (outer - bias);
      for (const ModelJoint& joint : model.joints) {
        if (joint.nv == 1)
          A(joint.v, joint.v) += h * joint.damping + state.rotors[static_cast<std::size_t>(joint.v)];
        if (joint.nv == 1) b[joint.v] += state.rotors[static_cast<std::size_t>(joint.v)] * v[joint.v];
      }
      for (std::size_t k = 0; k < state.springs.size(); ++k) {
        const JointSpring& spring = state.springs[k];
        if (!spring.on) continue;
        if (bound[k] != 0) {
          b[spring.v] += h * (bound[k] < 0 ? spring.low : spring.high);
          continue;
        }
        A(spring.v, spring.v) += h * spring.damping + h * h * spring.stiffness;
        b[spring.v] += h * spring.law(q[spring.q], 0.0, t);
      }
      Eigen::MatrixXd reduced = G.transpose() * A * G;
      for (const ModelJoint& joint : model.joints) {
        if (joint.mimics()) reduced(joint.v, joint.v) = 1.0;
      }
      fresh = G * reduced.ldlt().solve(G.transpose() * b);
      bool settled = true;
      for (std::size_t k = 0; k < state.springs.size(); ++k) {
        const JointSpring& spring = state.springs[k];
        if (!spring.on) continue;
        const double asked = spring.law(q[spring.q] + h * fresh[spring.v], fresh[spring.v], t);
        const int wanted = bound_of(spring, asked);
        settled = settled && wanted == bound[k];
        bound[k] = wanted;
        if (part + 1 == kParts)
          state.effort[static_cast<std::size_t>(spring.joint)] = std::clamp(asked, spring.low, spring.high);
      }
      if (settled) break;
    }
    for (const ModelJoint& joint : model.joints) {
      if (!joint.scalar() || joint.mimics()) continue;
      const auto at = static_cast<std::size_t>(joint.q), rate = static_cast<std::size_t>(joint.v);
      state.v[rate] = fresh[joint.v];
      state.q[at] += h * fresh[joint.v];
      if (state.q[at] < joint.lower || state.q[at] > joint.upper) {
        state.q[at] = std::clamp(state.q[at], joint.lower, joint.upper);
        state.v[rate] = 0.0;
      }
    }
    follow(model, state);
  }
  static void follow(const Model& model, State& state) {
    Eigen::Map<Eigen::VectorXd> positions(state.q.data(), model.nq);
    model.apply_mimics(positions);
    for (const ModelJoint& joint : model.joints) {
      if (joint.mimics())
        state.v[static_cast<std::size_t>(joint.v)] =
            joint.mimic_multiplier *
            state.v[static_cast<std::size_t>(model.joints[static_cast<std::size_t>(joint.mimic_leader)].v)];
    }
  }

  void become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) override {
    const std::vector<State> old = states_;
    world_ = std::move(world);
    states_.clear();
    for (std::size_t i = 0; i < kept.size(); ++i)
      states_.push_back(kept[i] >= 0 ? old[static_cast<std::size_t>(kept[i])]
                                     : start(this->world().instances()[i]));
  }
  [[nodiscard]] State& at(int i) { return states_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const State& at(int i) const { return states_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] const Model& model_of(int i) const {
    return *world().instances()[static_cast<std::size_t>(i)].model;
  }
  [[nodiscard]] int drive_index(int i, int joint) const {
    for (std::size_t k = 0; k < at(i).drives.size(); ++k) {
      if (at(i).drives[k].joint() == joint) return static_cast<int>(k);
    }
    return -1;
  }
  [[nodiscard]] std::span<const double> q_of(int i) const override { return at(i).q; }
  [[nodiscard]] std::span<const double> v_of(int i) const override { return at(i).v; }
  [[nodiscard]] std::span<const double> drive_effort_of(int i) const override { return at(i).effort; }
  void write_state(int i, std::span<const double> q, std::span<const double> v) override {
    at(i).q.assign(q.begin(), q.end());
    at(i).v.assign(v.begin(), v.end());
    follow(model_of(i), at(i));
    for (std::size_t k = 0; k < at(i).drives.size(); ++k)
      at(i).drives[k].follow(at(i).q[static_cast<std::size_t>(at(i).springs[k].q)]);
  }
  [[nodiscard]] const Pose& root_pose_of(int i) const override { return at(i).X_WR; }
  void write_root_pose(int i, const Pose& X_WR) override { at(i).X_WR = X_WR; }
  void start_drive(int i, int joint, DriveMode mode) override {
    const auto k = static_cast<std::size_t>(drive_index(i, joint));
    const JointSpring& spring = at(i).springs[k];
    at(i).drives[k].start(mode, at(i).q[static_cast<std::size_t>(spring.q)]);
    at(i).rotors[static_cast<std::size_t>(spring.v)] = at(i).drives[k].rotor();
    if (mode == DriveMode::passive) at(i).effort[static_cast<std::size_t>(joint)] = 0.0;
  }
  [[nodiscard]] DriveState drive_of(int i, int joint) const override {
    const int k = drive_index(i, joint);
    return k < 0 ? DriveState{} : at(i).drives[static_cast<std::size_t>(k)].state();
  }
  void write_target(int i, int joint, double target) override {
    at(i).drives[static_cast<std::size_t>(drive_index(i, joint))].set_target(target);
  }
  void write_servo(int i, int joint, const ServoParameters& servo) override {
    at(i).drives[static_cast<std::size_t>(drive_index(i, joint))].set_servo(servo);
  }
  void write_reference(int i, int joint, double reference) override {
    at(i).drives[static_cast<std::size_t>(drive_index(i, joint))].follow(reference);
  }
  void write_joint_effort(int i, int joint, double effort) override {
    at(i).applied[static_cast<std::size_t>(model_of(i).joints[static_cast<std::size_t>(joint)].v)] = effort;
  }
  void write_wrench(int i, int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                    const Eigen::Vector3d& torque_W) override {
    at(i).p_LoP_L[static_cast<std::size_t>(link)] = p_LoP_L;
    at(i).force_W[static_cast<std::size_t>(link)] = force_W;
    at(i).torque_W[static_cast<std::size_t>(link)] = torque_W;
  }
  [[nodiscard]] Pose pose_of(int i, int link) const override {
    Data data(model_of(i));
    forward_kinematics(model_of(i), data, vector(at(i).q));
    return at(i).X_WR * data.X_WL[static_cast<std::size_t>(link)];
  }
  [[nodiscard]] FrameVelocity velocity_of(int i, int link) const override {
    Data data(model_of(i));
    forward_kinematics(model_of(i), data, vector(at(i).q));
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model_of(i).nv);
    jacobian(model_of(i), data, link, Eigen::Vector3d::Zero(), J);
    const Eigen::VectorXd V = J * vector(at(i).v);
    return {at(i).X_WR.linear() * V.tail<3>(), at(i).X_WR.linear() * V.head<3>()};
  }

  std::vector<State> states_;
  std::int64_t steps_ = 0;
  bool diverged_ = false;
};

EngineCapabilities capabilities_of_analytic() {
  EngineCapabilities out;
  out.name = "analytic";
  out.version = "1";
  out.mimics = true;
  out.integrators = {Integrator::euler};
  return out;
}

const EngineCapabilities& AnalyticWorld::capabilities() const {
  static const EngineCapabilities capabilities = capabilities_of_analytic();
  return capabilities;
}

std::unique_ptr<Engine> AnalyticWorld::make_engine() const {
  return std::make_unique<AnalyticEngine>(shared_from_this());
}

std::shared_ptr<const CompiledWorld> compile(WorldSettings settings, std::vector<ModelInstance> instances,
                                             Diagnostics&) {
  return std::make_shared<const AnalyticWorld>(std::move(settings), std::move(instances));
}

}  // namespace

EngineModule analytic_engine() {
  return {capabilities_of_analytic(), &compile};
}

}  // namespace doppel::test
