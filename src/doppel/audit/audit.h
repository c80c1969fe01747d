#pragma once
// The audit: graded findings over a description, each with its place in the source, what it leads to and the
// fix. Rules only look; a repair that is uniquely determined is offered as overlay operations.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/load.h"
#include "doppel/export.h"
#include "doppel/kinematics/model.h"
#include "doppel/overlay/operation.h"

namespace doppel {

// Who is going to use the description; a finding that concerns none of the chosen ones is left out.
enum class Profile : unsigned { gazebo = 1, moveit = 2, mujoco = 4, ros2_control = 8 };
inline constexpr unsigned kAllProfiles = 15;

struct RuleInfo {
  std::string_view id;       // "inertia.triangle"
  Severity severity;         // the usual one; a finding may be graded lower where it is harmless
  std::string_view title;    // what is wrong, in a few words
  std::string_view failure;  // what it leads to downstream: the failure that the rule prevents
  std::string_view fix;      // what to do in general
  unsigned profiles = kAllProfiles;
};
// Every rule, sorted by id, those of the parsers (urdf.*, xacro.*, mesh.*, overlay.*) included.
DOPPEL_API const std::vector<RuleInfo>& rule_table();
DOPPEL_API const RuleInfo* find_rule(std::string_view id);

struct Finding {
  std::string rule;
  Severity severity = Severity::error;
  std::string subject;      // "joint 'Revolute 1'"
  std::string message;      // what is wrong, with the numbers
  std::string consequence;  // what it leads to; the rule's where empty
  SourceLocation where;
  std::string fix;
  std::vector<Operation> repair;  // not empty: exactly this fixes it
};

struct AuditOptions {
  unsigned profiles = kAllProfiles;
  std::filesystem::path package_folder;              // empty: none
  std::optional<std::filesystem::path> controllers;  // a YAML in place of the description's own
  std::optional<std::filesystem::path> datasheet;    // limits are compared with it
  std::filesystem::path datasheet_folder;            // the library of servos
};

struct DOPPEL_API AuditReport {
  std::string robot;
  std::filesystem::path file;
  std::vector<Finding> findings;  // errors first, then by place
  std::size_t links = 0, joints = 0;
  double mass = 0;  // kg, the sum of what is written
  [[nodiscard]] std::size_t count(Severity severity) const;
};

// All that the rules see. `robot` holds what could be read of a faulty file; `model` is there only where the
// tree is sound.
struct AuditInput {
  const ExpandedDescription& expanded;
  const RobotDescription& robot;
  const Model* model = nullptr;
  const PackageResolver& resolver;
  const AuditOptions& options;
};

// Reads the file (with its overlay), applies every rule. Throws InputError where there is nothing to judge:
// unreadable, XML not well-formed, xacro errors, no <robot>.
DOPPEL_API AuditReport audit(const std::filesystem::path& file, const XacroArguments& arguments,
                             PackageResolver& resolver, const AuditOptions& options);

// Elements and attributes that nothing reads, where a known one was surely meant: cheap enough for every
// reload.
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
