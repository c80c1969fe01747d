#include "doppel/audit/rules_detail.h"

namespace doppel::audit_rules {

void check_schema(const AuditInput&, Findings&) {}

}  // namespace doppel::audit_rules
