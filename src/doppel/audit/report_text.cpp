// The audit for people.
#include <fmt/format.h>

#include "doppel/audit/audit.h"

namespace doppel {

std::string to_text(const AuditReport& report, const TextStyle&) {
  std::string out;
  for (const Finding& f : report.findings) {
    out += fmt::format("{} {} {}: {} [{}]\n", to_string(f.severity), f.where.str(), f.subject, f.message,
                       f.rule);
  }
  return out;
}

std::string rules_markdown() {
  std::string out;
  for (const RuleInfo& rule : rule_table()) out += fmt::format("{}\n", rule.id);
  return out;
}

}  // namespace doppel
