#pragma once
// One controller of ROS 1 while it is mapped: its parameters, each of which is read or reported, and those of the
// controller of ROS 2.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel {

class Ros1Mapping {
 public:
  // values: with names below the controller, "linear.x.max_velocity".
  Ros1Mapping(std::string controller, std::vector<ParameterOverride> values,
              const RobotDescription& described)
      : robot(described), name(std::move(controller)), values_(std::move(values)) {}

  // Marks it as read. nullptr: not written.
  const ParameterOverride* take(std::string_view parameter);
  [[nodiscard]] std::optional<double> number(std::string_view parameter);
  [[nodiscard]] bool flag(std::string_view parameter, bool otherwise);
  [[nodiscard]] std::vector<std::string> names(std::string_view parameter);  // a string or a list of them
  void drop(std::string_view parameter) { take(parameter); }  // its effect is what always happens in ROS 2

  // To the parameter `to`, with the place of `from`, "": with that of the controller.
  void set(const std::string& to, ParameterValue value, std::string_view from);
  void copy(std::string_view from, const std::string& to);
  void copy(std::string_view same) { copy(same, std::string(same)); }
  // A length from the file, or else derived from the description; text: "wheel radius".
  [[nodiscard]] double length(std::string_view parameter, std::optional<double> derived, const char* text);

  [[nodiscard]] std::vector<std::string> unread() const;
  [[nodiscard]] SourceLocation place_of(std::string_view parameter) const;

  const RobotDescription& robot;
  const std::string name;
  std::string type;                       // of ROS 2; empty: no counterpart
  std::vector<std::string> remaps;        // "-r", "~/reference:=..."
  std::vector<ParameterOverride> mapped;  // the parameters of ROS 2
  std::vector<std::string> derived;       // "wheel radius 0.0331 m"

 private:
  std::vector<ParameterOverride> values_;
};

// Maps a controller by its ROS 1 type; type stays empty where there is no counterpart.
void map_ros1_controller(std::string_view type, Ros1Mapping& out);

}  // namespace doppel
