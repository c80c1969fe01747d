#include "doppel/audit/rules_detail.h"

namespace doppel::audit_rules {

void check_joints(const AuditInput&, Findings&) {}
void check_mimics(const AuditInput&, Findings&) {}

}  // namespace doppel::audit_rules
