#include "doppel/validation/checks/validation_report.h"

#include <algorithm>

namespace doppel {

bool ValidationReport::passed() const {
  return complete && regressions.empty() && std::ranges::none_of(checks, [this](const CheckResult& check) {
           return is_failure(check.verdict, strict);
         });
}

std::size_t ValidationReport::count(Verdict verdict) const {
  return static_cast<std::size_t>(std::ranges::count(checks, verdict, &CheckResult::verdict));
}

}  // namespace doppel
