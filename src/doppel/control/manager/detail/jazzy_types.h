#pragma once
// The controller types of ROS 2 Jazzy: a valid type that is not available here is not a typo.

#include <string_view>

namespace doppel {

// True if ros2_controllers of Jazzy, or a package that comes with it, has a controller of this type.
bool is_jazzy_type(std::string_view type);

}  // namespace doppel
