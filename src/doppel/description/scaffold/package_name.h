#pragma once
// Names that ROS 2 accepts for a package (REP 144).

#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel::scaffold {

struct PackageName {
  std::string robot, package;  // "my_arm", "my_arm_description"
};

// `name` is the robot's or the package's. Throws InputError with a similar valid name.
DOPPEL_API PackageName package_name(std::string_view name);

}  // namespace doppel::scaffold
