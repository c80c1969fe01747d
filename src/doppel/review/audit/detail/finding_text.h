#pragma once
// The texts of a finding in every form of the report: its own, else those of its rule.

#include <string>

#include "doppel/review/audit/audit.h"

namespace doppel {

inline std::string fix_of(const Finding& finding) {
  const RuleInfo* rule = find_rule(finding.rule);
  return !finding.fix.empty() || rule == nullptr ? finding.fix : std::string(rule->fix);
}

inline std::string consequence_of(const Finding& finding) {
  const RuleInfo* rule = find_rule(finding.rule);
  return !finding.consequence.empty() || rule == nullptr ? finding.consequence : std::string(rule->failure);
}

}  // namespace doppel
