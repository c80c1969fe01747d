#pragma once
// A rule is a function over the input that adds findings. One file per subject; the purpose of each rule is
// in the tables of rule_table.cpp and rule_table_ros.cpp.

#include <fmt/format.h>

#include <span>

#include "doppel/description/meshes/mesh_report.h"
#include "doppel/review/audit/audit.h"

namespace doppel::audit_rules {

class Findings {
 public:
  // The severity is the rule's own, unless a lower one is given. The id must be in the table. The
  // reference is valid until the next add().
  Finding& add(std::string_view rule, std::string subject, SourceLocation where, std::string message,
               std::string fix = "");
  Finding& add(std::string_view rule, Severity severity, std::string subject, SourceLocation where,
               std::string message, std::string fix = "");
  [[nodiscard]] std::vector<Finding>& all() { return all_; }
  [[nodiscard]] const std::vector<Finding>& all() const { return all_; }
  // An earlier finding of a rule about this subject; nullptr: none.
  [[nodiscard]] const Finding* find(std::string_view rule, std::string_view subject) const;
  [[nodiscard]] bool has(std::string_view rule, std::string_view subject) const {
    return find(rule, subject) != nullptr;
  }

 private:
  std::vector<Finding> all_;
};

// Reports a file beside the description that is not read, as a note of the rule "audit.skipped".
void report_skipped(const InputError& error, Findings& out);
void report_skipped(const Diagnostics& skipped, Findings& out);

// The rows of the table: those of the description and of the parsers, and those about ROS.
std::span<const RuleInfo> description_rules();  // rule_table.cpp
std::span<const RuleInfo> parser_rules();       // rule_table_parsers.cpp
std::span<const RuleInfo> ros_rules();          // rule_table_ros.cpp

void check_schema(const AuditInput& in, Findings& out);        // rules_schema.cpp
void check_joints(const AuditInput& in, Findings& out);        // rules_joints.cpp
void check_origins(const AuditInput& in, Findings& out);       // rules_origins.cpp
void check_mimics(const AuditInput& in, Findings& out);        // rules_mimics.cpp
void check_inertia(const AuditInput& in, Findings& out);       // rules_inertia.cpp
void check_meshes(const AuditInput& in, Findings& out);        // rules_meshes.cpp
void check_shapes(const AuditInput& in, Findings& out);        // rules_shapes.cpp
void check_names(const AuditInput& in, Findings& out);         // rules_names.cpp
void check_collisions(const AuditInput& in, Findings& out);    // rules_collisions.cpp
void check_ros2_control(const AuditInput& in, Findings& out);  // rules_ros2_control.cpp
void check_calibration(const AuditInput& in, Findings& out);   // rules_calibration.cpp
void check_controllers(const AuditInput& in, Findings& out);   // rules_controllers.cpp
void check_package(const AuditInput& in, Findings& out);       // rules_package.cpp
void check_srdf(const AuditInput& input, Findings& out);       // rules_srdf.cpp
void check_world(const AuditInput& in, Findings& out);         // rules_world.cpp
void check_datasheet(const AuditInput& in, Findings& out);     // rules_datasheet.cpp

}  // namespace doppel::audit_rules
