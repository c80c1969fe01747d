#pragma once
// The audit: graded findings about a description, each with its place in the source, its consequence and the
// fix. Rules have no side effects; an unambiguous repair is provided as overlay operations.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/overlay/operation.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// The tools that will use the description; findings that concern none of the selected ones are left out.
enum class Profile : unsigned { gazebo = 1, moveit = 2, mujoco = 4, ros2_control = 8 };
inline constexpr unsigned kAllProfiles = 15;

struct RuleInfo {
  std::string_view id;       // "inertia.triangle"
  Severity severity;         // the usual one; a harmless finding may have a lower one
  std::string_view title;    // the problem in a few words
  std::string_view failure;  // the consequence: the failure that the rule prevents
  std::string_view fix;      // the general fix
  unsigned profiles = kAllProfiles;
};
// All rules, sorted by id, including those of the parsers (urdf.*, xacro.*, mesh.*, overlay.*). Any thread.
DOPPEL_API const std::vector<RuleInfo>& rule_table();
DOPPEL_API const RuleInfo* find_rule(std::string_view id);

struct Finding {
  std::string rule;
  Severity severity = Severity::error;
  std::string subject;      // "joint 'Revolute 1'"
  std::string message;      // the problem, with the values
  std::string consequence;  // empty: the rule's
  SourceLocation where;
  std::string fix;
  std::vector<Operation> repair;  // the unambiguous repair; empty: there is none
};

struct AuditOptions {
  unsigned profiles = kAllProfiles;
  std::filesystem::path package_folder;              // empty: none
  std::optional<std::filesystem::path> controllers;  // a YAML instead of the description's own
  std::optional<std::filesystem::path> datasheet;    // limits are compared with it
  std::filesystem::path datasheet_folder;            // the library of servos
};

struct DOPPEL_API AuditReport {
  std::string robot;
  std::filesystem::path file;
  std::vector<Finding> findings;  // errors first, then by place
  std::size_t links = 0, joints = 0;
  double mass = 0;  // kg, the sum of the written masses
  [[nodiscard]] std::size_t count(Severity severity) const;
};

struct AppliedOverlay;  // description/overlay/overlay.h

// The input of the rules. `robot` contains what could be read of a faulty file; `model` is nullptr unless the
// tree is valid.
struct AuditInput {
  const ExpandedDescription& expanded;
  const RobotDescription& robot;
  const Model* model = nullptr;
  const PackageResolver& resolver;
  const AuditOptions& options;
  const std::vector<AppliedOverlay>* overlays = nullptr;  // nullptr: unknown
};

// Reads the file (with its overlay) and applies every rule. Throws InputError if there is nothing to audit:
// unreadable, XML not well-formed, xacro errors, no <robot>.
DOPPEL_API AuditReport audit(const std::filesystem::path& file, const XacroArguments& arguments,
                             PackageResolver& resolver, const AuditOptions& options);

// Findings for unknown elements and attributes that are typos of known ones; cheap enough for every reload.
DOPPEL_API std::vector<Finding> misspellings(const ExpandedDescription& expanded);

// -- reports (report_text.cpp, report_json.cpp)
struct TextStyle {
  bool colour = false;
  int width = 100;
  bool summary_only = false;  // the last line, with the counts
};
DOPPEL_API std::string to_text(const AuditReport& report, const TextStyle& style);
DOPPEL_API std::string rules_text(const TextStyle& style);  // every rule with the failure it prevents
DOPPEL_API std::string rules_markdown();                    // the same, as docs/rules.md
DOPPEL_API std::string to_json(const AuditReport& report);
DOPPEL_API std::string to_sarif(const AuditReport& report);
DOPPEL_API std::string to_github(const AuditReport& report);  // ::error file=...,line=...::...

}  // namespace doppel
