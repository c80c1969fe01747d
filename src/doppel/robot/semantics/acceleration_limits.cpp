#include "doppel/robot/semantics/acceleration_limits.h"

#include <algorithm>
#include <cmath>

#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

// Less is rounding of the recursion, and couples nothing.
constexpr double kMinInertia = 1e-15;  // kg m^2, kg m or kg

// The drives in one configuration.
struct DriveSample {
  Eigen::MatrixXd inertia;  // [joints, joints] magnitudes; mimics are part of their leaders
  Eigen::VectorXd gravity;  // [joints] magnitudes, N m or N
};

class AccelerationSearch {
 public:
  AccelerationSearch(const Model& model, const Eigen::Vector3d& gravity)
      : model_(model), count_(static_cast<Eigen::Index>(model.joints.size())) {
    sample(gravity);
    out_.joints.resize(model.joints.size());
  }

  AccelerationLimits take() {
    for (Eigen::Index j = 0; j < count_; ++j) classify(j);
    for (Eigen::Index k = 0; k < count_; ++k) {
      if (has_limit(k)) find_alone(k);
    }
    find_share();
    for (JointAcceleration& joint : out_.joints) {
      if (joint.kind == AccelerationKind::derived) joint.limit = out_.share * joint.alone;
    }
    for (std::size_t i = 0; i < out_.joints.size(); ++i) {
      const ModelJoint& joint = model_.joints[i];
      if (out_.joints[i].kind != AccelerationKind::follows) continue;
      const double leader = out_.joints[static_cast<std::size_t>(joint.mimic_leader)].limit;
      out_.joints[i].limit = std::isfinite(leader) ? std::abs(joint.mimic_multiplier) * leader : kInfinity;
    }
    return std::move(out_);
  }

 private:
  void sample(const Eigen::Vector3d& gravity) {
    Data data(model_);
    // v of all joints per unit of the driven one.
    Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(model_.nv, count_);
    for (Eigen::Index i = 0; i < count_; ++i) {
      const ModelJoint& joint = joint_at(i);
      if (!joint.scalar()) continue;
      moved(joint.v, joint.mimics() ? joint.mimic_leader : i) = joint.mimics() ? joint.mimic_multiplier : 1.0;
    }
    Eigen::VectorXd torques;
    for (const Eigen::VectorXd& q : sample_configurations(model_, kAccelerationSamples)) {
      mass_matrix(model_, data, q);
      gravity_torques(model_, data, q, gravity);
      drive_torques(model_, data, torques);
      samples_.push_back({(moved.transpose() * data.M * moved).cwiseAbs(), torques.cwiseAbs()});
    }
  }

  [[nodiscard]] const ModelJoint& joint_at(Eigen::Index i) const {
    return model_.joints[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] JointAcceleration& result(Eigen::Index i) { return out_.joints[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool has_limit(Eigen::Index i) const {
    return out_.joints[static_cast<std::size_t>(i)].kind == AccelerationKind::derived;
  }

  void classify(Eigen::Index i) {
    const ModelJoint& joint = joint_at(i);
    JointAcceleration& out = result(i);
    if (!joint.scalar()) return;
    for (const DriveSample& one : samples_) {
      out.gravity = std::max(out.gravity, one.gravity[i]);
      out.inertia = std::max(out.inertia, one.inertia(i, i));
    }
    if (joint.mimics()) {
      out.kind = AccelerationKind::follows;
    } else if (!std::isfinite(joint.effort)) {
      out.kind = AccelerationKind::no_effort;
    } else if (out.gravity >= joint.effort) {
      out.kind = AccelerationKind::cannot_hold;
    } else {
      out.kind = out.inertia < kMinInertia ? AccelerationKind::no_inertia : AccelerationKind::derived;
    }
  }

  // N m or N: what gravity leaves to the drive.
  [[nodiscard]] double rest(const DriveSample& one, Eigen::Index j) const {
    return joint_at(j).effort - one.gravity[j];
  }

  void find_alone(Eigen::Index k) {
    for (const DriveSample& one : samples_) {
      for (Eigen::Index j = 0; j < count_; ++j) {
        if (!has_limit(j) || one.inertia(j, k) < kMinInertia) continue;
        result(k).alone = std::min(result(k).alone, rest(one, j) / one.inertia(j, k));
      }
    }
  }

  void find_share() {
    for (const DriveSample& one : samples_) {
      for (Eigen::Index j = 0; j < count_; ++j) {
        if (!has_limit(j)) continue;
        double load = 0;
        for (Eigen::Index k = 0; k < count_; ++k) {
          if (has_limit(k)) load += one.inertia(j, k) * result(k).alone;
        }
        if (load * out_.share <= rest(one, j)) continue;
        out_.share = rest(one, j) / load;
        out_.decisive = static_cast<int>(j);
      }
    }
  }

  const Model& model_;
  Eigen::Index count_;
  std::vector<DriveSample> samples_;
  AccelerationLimits out_;
};

}  // namespace

AccelerationLimits acceleration_limits(const Model& model, const Eigen::Vector3d& gravity) {
  return AccelerationSearch(model, gravity).take();
}

}  // namespace doppel
