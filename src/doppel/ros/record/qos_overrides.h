#pragma once
// The qualities of topics that a file of ros2 bag's --qos-profile-overrides-path gives.

#include <filesystem>
#include <map>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

// The result is by topics. Policies that are not given have the values of ROS 2's default profile. Throws
// InputError with all errors of the file: "qos.syntax", "qos.unreadable", "qos.unknown_key", "qos.invalid".
[[nodiscard]] DOPPEL_API std::map<std::string, Qos> read_qos_overrides(const std::filesystem::path& file);

}  // namespace doppel
