#pragma once
// A joint's servo as a description states it and as an identification finds it (docs/identification.md):
//
//   <gazebo reference="elbow"><doppel:servo stiffness="35" damping="1.2" armature="0.01"/></gazebo>
//
// Its limits are those of <limit>, its friction and viscous friction those of <dynamics>.

#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/physics/contract/servo.h"

namespace doppel {

struct DescribedServo {
  std::string joint;
  std::optional<double> stiffness, damping;    // N m/rad, N m s/rad; or N/m, N s/m
  std::optional<double> armature;              // kg m^2 or kg
  std::optional<double> delay;                 // s, from command to reference; not simulated
  std::optional<double> backlash, resolution;  // rad or m; not simulated
  std::optional<double> rms = {};              // rad or m, of the identification's residuals
  SourceLocation source = {};
};

// In the description's order. An attribute that is unknown, or no number, is a warning ("servo.value") and
// without effect.
DOPPEL_API std::vector<DescribedServo> described_servos(const RobotDescription& robot,
                                                        Diagnostics& diagnostics);

// choose_servos() with the values that the description states in their place. Without a damping, the chosen
// damping ratio is kept.
DOPPEL_API std::vector<ServoParameters> choose_servos(const RobotDescription& robot, const Model& model,
                                                      const ServoOptions& options,
                                                      const Eigen::Vector3d& gravity);

}  // namespace doppel
