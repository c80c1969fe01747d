#pragma once
// The controllers' YAML as the rules look at it.

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/audit/detail/rules.h"
#include "doppel/bus/parameter_file.h"
#include "doppel/control/controller.h"

namespace doppel::audit_rules {

using PlacedName = std::pair<std::string, SourceLocation>;

struct DeclaredController {
  std::string name, type;
  SourceLocation where;
  ParameterOverrides parameters;
  bool has_other_files = false;  // params_file: more parameters stand elsewhere
  bool known_kind = false;       // its interfaces follow from the parameters that interfaces() knows

  [[nodiscard]] std::string subject() const { return "controller '" + name + "'"; }
  // A list of texts, or one text, each with its place.
  [[nodiscard]] std::vector<PlacedName> texts(std::string_view parameter) const;
  [[nodiscard]] std::optional<std::pair<double, SourceLocation>> number(std::string_view parameter) const;
  // The interfaces it claims of each of its joints.
  [[nodiscard]] std::vector<PlacedName> interfaces(bool commands) const;
  [[nodiscard]] std::vector<std::string> driven_joints() const;
};

struct ControllersFile {
  std::filesystem::path path;
  bool chosen = false;  // named by the description or by the caller, not only found
  std::vector<DeclaredController> controllers;
  std::vector<PlacedName> other_sections;  // with parameters, of no declared controller
  double update_rate = 0;                  // Hz; 0: not written
  SourceLocation rate_where;
};

// The caller's file; else what the description's <parameters> name; else the one file of the package's
// config/ that declares controllers. What cannot be read becomes a finding.
std::vector<ControllersFile> read_controllers(const AuditInput& in, Findings& out);

// Initialises the controller and reports what it refuses, whole numbers where ROS 2 wants decimals, and
// parameters that nobody reads.
void check_parameters(const AuditInput& in, const ControllersFile& file, DeclaredController& controller,
                      const ControllerRegistry::Type& type, Findings& out);

}  // namespace doppel::audit_rules
