#pragma once
// An arm with what the extras need: its tool, its drives, its free configurations and their distance.

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/physics/contract/servo.h"
#include "doppel/robot/reach/arm_reach.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

inline constexpr double kPercent = 100;      // in the whole
inline constexpr double kMillimetres = 1e3;  // in a metre

struct ArmPlace {
  Eigen::VectorXd q;    // [nq] of Subject::model
  double distance = 0;  // m: ExtraArm::distance
};

class ExtraArm {
 public:
  ExtraArm(const CheckContext& context, const ArmGroup& group);

  [[nodiscard]] const std::string& name() const { return group_.name; }
  [[nodiscard]] const Model& model() const { return *subject_.model; }
  [[nodiscard]] const Chain& chain() const { return group_.chain; }
  [[nodiscard]] ArmReach reach() const { return {subject_.model, group_.chain, scene_}; }
  // The joint of the model behind a variable of the chain.
  [[nodiscard]] const ModelJoint& joint(int variable) const;
  [[nodiscard]] bool slides(int variable) const { return joint(variable).type == JointType::prismatic; }
  // The simulated drive; a servo without stiffness where there is none.
  [[nodiscard]] const ServoParameters& servo(int variable) const;
  [[nodiscard]] const Eigen::Vector3d& gravity() const { return subject_.robot().gravity_R(); }

  // -- the tool: the suite's link if the arm moves it, else the tip
  [[nodiscard]] int tool_link() const { return tool_link_; }
  [[nodiscard]] const Eigen::Vector3d& p_LoC_L() const { return p_LoC_L_; }  // of a payload
  [[nodiscard]] double payload() const { return payload_; }                  // kg, of the suite; 0: none

  // Precondition of these: forward_kinematics of `data`.
  [[nodiscard]] Eigen::Vector3d tool_position(const Data& data) const;
  // m: horizontally from the origin of the first joint to the tool; without gravity in space.
  [[nodiscard]] double distance(const Data& data) const;
  // [6, variables] of a point of the tool's link, with what follows of mimics: angular, then linear.
  [[nodiscard]] Eigen::Matrix<double, 6, Eigen::Dynamic> tool_jacobian(const Data& data,
                                                                       const Eigen::Vector3d& p_LoP_L) const;
  // [nv, variables]: the rates of all joints per rate of each variable, mimics included.
  [[nodiscard]] const Eigen::MatrixXd& coupling() const { return coupling_; }
  // The load of gravity on each drive of the model [joints], N m or N, and the load of 1 kg at p_LoC_L().
  [[nodiscard]] Eigen::VectorXd gravity_load(Data& data, const Eigen::VectorXd& q) const;
  [[nodiscard]] Eigen::VectorXd unit_load(Data& data, const Eigen::VectorXd& q) const;

  // Configurations in which the arm touches nothing of itself, the same for the same seed.
  [[nodiscard]] std::vector<ArmPlace> places(int count, std::uint64_t seed) const;
  // The largest distance that a search from the farthest of these finds, and its configuration.
  [[nodiscard]] ArmPlace farthest(const std::vector<ArmPlace>& places) const;

 private:
  const Subject& subject_;
  const ArmGroup& group_;
  std::shared_ptr<const CollisionScene> scene_;
  Eigen::VectorXd start_;  // [nq]
  Eigen::Vector3d first_joint_ = Eigen::Vector3d::Zero();
  int tool_link_ = -1;
  Eigen::Vector3d p_LoC_L_ = Eigen::Vector3d::Zero();
  double payload_ = 0;
  Eigen::MatrixXd coupling_;
};

// The arms of the machine that are judged: those with the joint of the context, else all.
[[nodiscard]] std::vector<ExtraArm> extra_arms(const CheckContext& context);
// The reason of a check for which there is none of these arms.
[[nodiscard]] std::string no_arm_reason(const CheckContext& context);

// The start, and the suite's poses.
struct NamedPose {
  std::string name;
  Eigen::VectorXd q;  // [nq] of Subject::model
};
[[nodiscard]] std::vector<NamedPose> named_poses(const CheckContext& context);

}  // namespace doppel
