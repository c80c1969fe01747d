#pragma once
// The gate to which a finding of the audit belongs, so that each finding fails one gate.

#include <string_view>

#include "doppel/review/audit/audit.h"
#include "doppel/validation/checks/check.h"

namespace doppel {

enum class AuditPart { parsing, inertias, limits, meshes, collisions, control };

[[nodiscard]] AuditPart part_of_rule(std::string_view rule);

// Adds the errors of a part as failures, and its warnings; notes are counted.
void add_findings(const AuditReport& report, AuditPart part, CheckResult& out);

}  // namespace doppel
