#pragma once
// A robot as one argument of the command line: TARGET[:NAMESPACE][@x,y,z[,roll,pitch,yaw]], m and rad.

#include <string>

#include "doppel/export.h"
#include "doppel/physics/contract/world_robot.h"

namespace doppel {

// Throws InputError. An existing file whose name has a colon or an @ is not split.
DOPPEL_API WorldRobot parse_robot(const std::string& text);

// "x,y,z" or "x,y,z,roll,pitch,yaw", m and rad. Throws InputError; `option` is the option's name
// in the message.
DOPPEL_API Pose parse_place(const std::string& text, const std::string& option);

}  // namespace doppel
