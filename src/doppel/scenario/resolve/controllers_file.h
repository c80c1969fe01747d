#pragma once
// The one reader of controllers' files: the controllers that a YAML declares for ros2_control, their
// parameters, joints and interfaces, each with its place.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {

using PlacedName = std::pair<std::string, SourceLocation>;

struct DOPPEL_API DeclaredController {
  std::string name, type;  // type: empty if it is not written
  SourceLocation where;
  ParameterOverrides parameters;
  bool has_other_files = false;  // params_file: further parameters are in other files

  [[nodiscard]] std::string subject() const { return "controller '" + name + "'"; }
  [[nodiscard]] bool broadcasts() const { return type.find("Broadcaster") != std::string::npos; }
  // True if interfaces() supports its type.
  [[nodiscard]] bool known_kind() const;
  // The strings of a parameter that is a list or one string, each with its place.
  [[nodiscard]] std::vector<PlacedName> texts(std::string_view parameter) const;
  [[nodiscard]] std::optional<std::pair<double, SourceLocation>> number(std::string_view parameter) const;
  // The command or state interfaces of each of its joints.
  [[nodiscard]] std::vector<PlacedName> interfaces(bool commands) const;
  [[nodiscard]] std::vector<std::string> driven_joints() const;
  // The values of parameters whose names end like those for joints: "joints", "left_wheel_names".
  [[nodiscard]] std::vector<std::string> named_joints() const;
};

struct ControllersFile {
  std::filesystem::path path;
  bool for_ros2 = false;  // declares controllers, or a manager of them, in any namespace
  bool named = false;     // by the description or by the user, not only found
  bool of_ros1 = false;   // mapped from a file of ROS 1 (ros1_controllers.h)
  std::vector<DeclaredController> controllers;
  std::vector<PlacedName> other_sections;  // sections with parameters that belong to no declared controller
  double update_rate = 0;                  // Hz; 0: not written
  SourceLocation rate_where;
};

// The declarations of `file` for controller managers in any namespace. Does not throw.
DOPPEL_API ControllersFile controllers_in(const ParameterFile& file);

// "controller_manager", in any namespace.
DOPPEL_API bool is_controller_manager(std::string_view node);

}  // namespace doppel
