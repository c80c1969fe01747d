#pragma once
// A report with every verdict, curves, configurations of omarm_one and names that are hard to write.

#include "doppel/validation/checks/subject.h"
#include "doppel/validation/checks/validation_report.h"

namespace doppel::reports_test {

inline constexpr const char* kHardName = "a <b> & \"c\" 'd' \xC3\xA9\xE2\x82\xAC | `e` \x1b[31m \xFF";

// `subject`: of omarm_one, for names of joints and links and the files' hashes; nullptr: none.
ValidationReport example_report(const Subject* subject = nullptr);

Subject bundled_subject(const char* robot);

}  // namespace doppel::reports_test
