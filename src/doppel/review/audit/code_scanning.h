#pragma once
// Results with their places in the source, for tools that show them beside the code: SARIF 2.1.0 (OASIS
// standard, March 2020) and the annotations of GitHub's workflows.

#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

struct ScannedRule {
  std::string id, title, failure, fix;
  std::string level;  // "error", "warning", "note"
};

struct ScannedResult {
  std::string rule;
  std::string level;  // "error", "warning", "note"
  std::string message;
  SourceLocation where;     // may be unknown
  std::string waived = {};  // why it is accepted; empty: it is not
};

// One run of doppel. Bytes that are not UTF-8 are replaced.
DOPPEL_API std::string sarif_text(const std::vector<ScannedRule>& rules,
                                  const std::vector<ScannedResult>& results);

// "::error file=arm.urdf,line=3,col=5,title=T4::..." with a line end.
DOPPEL_API std::string github_annotation(const ScannedResult& result);

}  // namespace doppel
