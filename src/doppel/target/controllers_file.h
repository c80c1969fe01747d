#pragma once
// The one reader of controllers' files: which controllers a YAML declares for ros2_control, their parameters,
// and which joints and interfaces they are for. Everything keeps its place.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/bus/parameter_file.h"
#include "doppel/export.h"

namespace doppel {

using PlacedName = std::pair<std::string, SourceLocation>;

struct DOPPEL_API DeclaredController {
  std::string name, type;  // type: empty where only other keys of it are written
  SourceLocation where;
  ParameterOverrides parameters;
  bool has_other_files = false;  // params_file: more parameters stand elsewhere

  [[nodiscard]] std::string subject() const { return "controller '" + name + "'"; }
  [[nodiscard]] bool broadcasts() const { return type.find("Broadcaster") != std::string::npos; }
  // Its interfaces follow from the parameters that interfaces() knows.
  [[nodiscard]] bool known_kind() const;
  // A list of texts, or one text, each with its place.
  [[nodiscard]] std::vector<PlacedName> texts(std::string_view parameter) const;
  [[nodiscard]] std::optional<std::pair<double, SourceLocation>> number(std::string_view parameter) const;
  // The interfaces it claims of each of its joints.
  [[nodiscard]] std::vector<PlacedName> interfaces(bool commands) const;
  [[nodiscard]] std::vector<std::string> driven_joints() const;
  // Whatever stands in parameters whose names end as those of joints do: "joints", "left_wheel_names".
  [[nodiscard]] std::vector<std::string> named_joints() const;
};

struct ControllersFile {
  std::filesystem::path path;
  bool for_ros2 = false;  // declares controllers, or a manager of them, in any namespace
  bool named = false;     // by the description or by the user, not only found
  std::vector<DeclaredController> controllers;
  std::vector<PlacedName> other_sections;  // with parameters, of no declared controller
  double update_rate = 0;                  // Hz; 0: not written
  SourceLocation rate_where;
};

// What `file` declares for controller managers in whichever namespace.
DOPPEL_API ControllersFile controllers_in(const ParameterFile& file);

// "controller_manager", in any namespace.
DOPPEL_API bool is_controller_manager(std::string_view node);

}  // namespace doppel
