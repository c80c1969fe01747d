#pragma once
// A validation as one HTML file for people: verdict, failures with their fix and evidence, all checks,
// environment. It needs no network, prints to A4, and has no script error without WebGL.

#include <string>

#include "doppel/export.h"
#include "doppel/validation/checks/subject.h"
#include "doppel/validation/checks/validation_report.h"

namespace doppel {

inline constexpr std::size_t kMaxReportBytes = 3'000'000;

// The page of `doppel view` and `up`, if the port is free.
inline constexpr const char* kUsualPage = "http://127.0.0.1:8700/";

// `subject`: whose arm is drawn in the configurations that the report shows; nullptr, or a subject without a
// machine: no arm is drawn. Curves and drawings that do not fit into kMaxReportBytes are left out, and the
// report says so. `page`: the address of the page that opens configurations, without a query.
DOPPEL_API std::string html_report(const ValidationReport& report, const Subject* subject,
                                   const std::string& page = kUsualPage);

// "doppel move 'Revolute 2=1.2'", quoted for a POSIX shell.
DOPPEL_API std::string move_command(const PosedEvidence& evidence);

}  // namespace doppel
