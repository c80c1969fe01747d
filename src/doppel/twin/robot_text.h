#pragma once
// A robot in one word, as a command line has it: TARGET[:NAMESPACE][@x,y,z[,roll,pitch,yaw]], m and rad.

#include <string>

#include "doppel/export.h"
#include "doppel/physics/world_robot.h"

namespace doppel {

// Throws InputError. A file whose name has a colon or an @ is taken as it is.
DOPPEL_API WorldRobot parse_robot(const std::string& text);

// "x,y,z" or "x,y,z,roll,pitch,yaw". Throws InputError; `option` is what it was given to.
DOPPEL_API Pose parse_place(const std::string& text, const std::string& option);

}  // namespace doppel
