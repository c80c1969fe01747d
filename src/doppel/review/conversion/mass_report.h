#pragma once
// The masses of a robot's links, and the loads of gravity on its joints.

#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct LinkMass {
  std::string link;
  double mass = 0, share = 0;                         // kg; of the total, 0..1
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      // m, in the link frame
  double gyration = 0;                                // m: root mean square distance of the mass from com
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();  // kg m^2, principal, ascending
};

struct JointLoad {
  std::string joint;
  bool slides = false;                   // N, not N m
  double at_zero = 0;                    // N m or N: load of gravity on the drive with all joints at zero
  double worst = 0;                      // N m or N: the largest magnitude over the sampled configurations
  std::optional<double> effort, margin;  // the limit; limit minus worst, negative: cannot hold everywhere
};

struct MassReport {
  double total = 0;                               // kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  // of the robot at zero, in the root link's frame
  std::vector<LinkMass> links;                    // those with a mass
  std::vector<JointLoad> joints;                  // those with a drive
};

// Gravity along -z of the root link, 9.81 m/s^2; `samples` configurations within the limits.
DOPPEL_API MassReport mass_report(const Model& model, int samples = 4000);

DOPPEL_API std::string mass_text(const MassReport& report);

// A comparison of the total mass with a measured one (kg, positive), in one or two lines.
DOPPEL_API std::string compared_with_scale(const MassReport& report, double measured);

}  // namespace doppel
