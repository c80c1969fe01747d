#include "doppel/audit/rules_detail.h"

namespace doppel::audit_rules {

void check_names(const AuditInput&, Findings&) {}

}  // namespace doppel::audit_rules
