#pragma once
// The labels of links and joints in trees.

#include <string>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/review/conversion/drawing.h"

namespace doppel {

DOPPEL_API std::string type_word(JointType type);  // "revolute"
DOPPEL_API bool turns(JointType type);
DOPPEL_API std::string axis_word(const Eigen::Vector3d& axis);      // "x", "-z", else "0 0.985 0.174"
DOPPEL_API std::string short_numbers(const Eigen::Vector3d& v);     // four digits
DOPPEL_API std::string millimetres_word(const Eigen::Vector3d& v);  // metres in, "-1 -10.2 13.5 mm" out
DOPPEL_API std::string degrees_word(const Eigen::Vector3d& rpy);    // in degrees
DOPPEL_API std::string limits_word(const Joint& joint);             // "0..180°", "0..0.05 m"; "" without
DOPPEL_API std::string mass_word(const Link& link);                 // "465.6 g", "2.1 kg"; "" without
DOPPEL_API std::string mass_word(double kilograms);
DOPPEL_API Tone joint_tone(JointType type);
// "omarm: 13 links, 12 joints (7 revolute, 5 fixed), 1284.4 g"
DOPPEL_API std::string headline(const RobotDescription& robot);

}  // namespace doppel
