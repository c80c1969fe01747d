// The wrench that a joint transmits, from the rates of momentum of the bodies beyond it.
#include <algorithm>

#include "doppel/sensors/rigs/detail/sensor_meter.h"

namespace doppel {
namespace {

constexpr double kSameAxes = 1e-9;

// A force and its torque about a point, in the world's axes.
struct WrenchSum {
  Eigen::Vector3d about_W, force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  void add(const Eigen::Vector3d& p_W, const Eigen::Vector3d& f_W,
           const Eigen::Vector3d& t_W = Eigen::Vector3d::Zero()) {
    force += f_W;
    torque += t_W + (p_W - about_W).cross(f_W);
  }
};

class WrenchMeter : public SensorMeter {
 public:
  WrenchMeter(const RigSensor& sensor, const MeterSettings& settings)
      : SensorMeter(sensor, 6), described_(std::get<ForceTorqueDescription>(sensor.description.what)) {
    for (const NoiseDescription& one : described_.force) add_noise(one, settings);
    for (const NoiseDescription& one : described_.torque) add_noise(one, settings);
  }

  [[nodiscard]] bool needs_contacts_before() const override { return true; }
  [[nodiscard]] bool needs_all_motions() const override { return true; }

  void bind(const Engine& engine, int instance) override {
    SensorMeter::bind(engine, instance);
    carried_.assign(engine.world().instances().size(), 0);
    if (instance < 0) return;
    const Model& model = *engine.world().instances()[static_cast<std::size_t>(instance)].model;
    beyond_.assign(model.links.size(), 0);
    beyond_[static_cast<std::size_t>(sensor_.link)] = 1;
    for (const ModelJoint& joint : model.joints)
      if (beyond_[static_cast<std::size_t>(joint.parent_link)] != 0)
        beyond_[static_cast<std::size_t>(joint.child_link)] = 1;
    choose_frame(model);
  }

  void measure(const PhysicalState& state, std::uint64_t sample) override;

 private:
  // Data in the axes of the child or parent name that link, unless the sensor's frame has the same axes.
  void choose_frame(const Model& model) {
    const ModelLink& link = model.links[static_cast<std::size_t>(sensor_.link)];
    frame_ = sensor_.frame;
    if (described_.frame == WrenchFrame::parent && link.joint >= 0) {
      const ModelJoint& joint = model.joints[static_cast<std::size_t>(link.joint)];
      frame_ = sensor_.frame_prefix + model.links[static_cast<std::size_t>(joint.parent_link)].name;
    } else if (described_.frame != WrenchFrame::sensor &&
               !sensor_.X_LF.linear().isApprox(Eigen::Matrix3d::Identity(), kSameAxes)) {
      frame_ = sensor_.frame_prefix + link.name;
    }
  }

  [[nodiscard]] bool has(BodyId body) const {
    if (body.is_ground()) return false;
    return body.instance == instance_ ? beyond_[static_cast<std::size_t>(body.link)] != 0
                                      : carried_[static_cast<std::size_t>(body.instance)] != 0;
  }
  void find_carried(const Engine& engine);
  [[nodiscard]] WrenchSum transmitted(const PhysicalState& state);
  // Axes of the data in the world, at the start of the step.
  [[nodiscard]] Eigen::Matrix3d axes(const InstanceMotion& motion) const;

  const ForceTorqueDescription described_;
  std::vector<char> beyond_;   // [links] of the sensor's instance
  std::vector<char> carried_;  // [instances]
};

// Instances that move freely and are attached beyond the joint, directly or by others.
void WrenchMeter::find_carried(const Engine& engine) {
  std::ranges::fill(carried_, 0);
  for (bool found = true; found;) {
    found = false;
    for (const Attachment& of : engine.attachments()) {
      if (has(of.a) == has(of.b)) continue;
      const BodyId other = has(of.a) ? of.b : of.a;
      if (other.is_ground() || other.instance == instance_) continue;
      if (!engine.instance(other.instance).made_of().floating()) continue;
      carried_[static_cast<std::size_t>(other.instance)] = 1;
      found = true;
    }
  }
}

// The wrench on the bodies beyond the joint, about the sensor's point: the rate of their momentum without the parts of
// gravity and contacts.
WrenchSum WrenchMeter::transmitted(const PhysicalState& state) {
  const Eigen::Vector3d& gravity = state.engine.world().settings().gravity;
  InstanceMotion& motion = *state.motions[static_cast<std::size_t>(instance_)];
  motion.solve_start(gravity);
  const auto link = static_cast<std::size_t>(sensor_.link);
  const Pose& X_WL = motion.X_WL()[link];
  WrenchSum sum{X_WL * sensor_.description.X_LS.translation()};
  const auto& F = motion.data().F_L[link];
  sum.add(X_WL.translation(), X_WL.linear() * F.tail<3>(), X_WL.linear() * F.head<3>());
  for (int i = 0; i < static_cast<int>(carried_.size()); ++i) {
    if (carried_[static_cast<std::size_t>(i)] == 0) continue;
    InstanceMotion& carried = *state.motions[static_cast<std::size_t>(i)];
    carried.solve_start(gravity);
    const Pose& X_WR = carried.X_WL()[0];
    const auto& of_all = carried.data().F_L[0];
    sum.add(X_WR.translation(), X_WR.linear() * of_all.tail<3>(), X_WR.linear() * of_all.head<3>());
  }
  for (const Contact& contact : state.before) {
    if (has(contact.b)) sum.add(contact.p_W, -contact.force_W, -contact.torque_W);
    if (has(contact.a)) sum.add(contact.p_W, contact.force_W, contact.torque_W);
  }
  return sum;
}

Eigen::Matrix3d WrenchMeter::axes(const InstanceMotion& motion) const {
  const Eigen::Matrix3d R_WL = motion.X_WL()[static_cast<std::size_t>(sensor_.link)].linear();
  if (described_.frame == WrenchFrame::sensor) return R_WL * sensor_.X_LF.linear();
  if (described_.frame == WrenchFrame::parent && sensor_.link > 0)
    return R_WL * motion.data().X_PL[static_cast<std::size_t>(sensor_.link)].linear().transpose();
  return R_WL;
}

void WrenchMeter::measure(const PhysicalState& state, std::uint64_t sample) {
  find_carried(state.engine);
  const WrenchSum sum = transmitted(state);
  const Eigen::Matrix3d R_AW = axes(*state.motions[static_cast<std::size_t>(instance_)]).transpose();
  // Parent to child: what the parent exerts on the child (gz-sensors 8, ForceTorqueSensor.cc).
  const double sign = described_.parent_to_child ? 1 : -1;
  write(0, noisy_vector(0, sign * (R_AW * sum.force), sample));
  write(3, noisy_vector(3, sign * (R_AW * sum.torque), sample));
}

}  // namespace

std::unique_ptr<SensorMeter> make_wrench_meter(const RigSensor& sensor, const MeterSettings& settings) {
  return std::make_unique<WrenchMeter>(sensor, settings);
}

}  // namespace doppel
