#pragma once
// The wheels of a robot as seen from its base, and the controller that fits them: for a robot on wheels whose
// description comes with neither a controllers' file nor a plugin that drives it.

#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/gazebo/base_plugins.h"
#include "doppel/physics/contract/model_instance.h"

namespace doppel {

// With all joints at their initial positions, in the axes of the base's root link, m.
struct BaseWheel {
  std::string joint;                                   // its axle
  std::string steering;                                // a joint about the vertical; empty: none
  bool steers_right = false;                           // its axis points down
  bool swivels = false;                                // behind an axis that nothing drives, as of a caster
  Eigen::Vector3d centre_B = Eigen::Vector3d::Zero();  // of the wheel, or of its steering joint
  Eigen::Vector3d axle_B = Eigen::Vector3d::UnitY();   // unit; a positive velocity turns about it
  double radius = 0;
  // Of a wheel with rollers: the direction along which it has friction, unit, in the plane. Zero: no rollers.
  Eigen::Vector3d grip_B = Eigen::Vector3d::Zero();
};

std::vector<BaseWheel> base_wheels(const ModelInstance& robot);

// The controller that drives these wheels; it reads cmd_vel and publishes odom and the transform of the base.
// nullopt: there are no wheels, or, with a note, none of the known bases has such wheels.
std::optional<MappedBase> base_for_wheels(const std::vector<BaseWheel>& wheels, const RobotDescription& robot,
                                          const std::string& name, Diagnostics& diagnostics);

// The message of the note that it was made.
std::string generated_base_text(const MappedBase& base);

}  // namespace doppel
