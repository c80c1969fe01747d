#pragma once
// A validation as text for terminals, test servers, code scanning and pull requests. Places are as in the
// report: shorten_places() (results.h) makes them relative.

#include <string>

#include "doppel/export.h"
#include "doppel/validation/checks/validation_report.h"

namespace doppel {

struct TerminalStyle {
  bool colour = false;
  int width = 100;
  bool failures_only = false;   // -q: failures and the last line
  std::string recordings = {};  // the folder of the recordings; empty: they are not written
};
// One line for each check, below it what fails and warns, and headline().
DOPPEL_API std::string to_text(const ValidationReport& report, const TerminalStyle& style);

// "passed: 15 gates, 6 tests; warning: G05" or "failed: T4, G05".
DOPPEL_API std::string headline(const ValidationReport& report);

// JUnit's XML: a suite for each check, a case for each item, metrics as properties.
DOPPEL_API std::string to_junit(const ValidationReport& report);

// SARIF 2.1.0: failures, warnings and waivers that have a place in the source.
DOPPEL_API std::string to_sarif(const ValidationReport& report);

// Annotations of GitHub's workflows: failures and warnings.
DOPPEL_API std::string to_github(const ValidationReport& report);

// GitHub's Markdown, for the summary of a job or a comment.
DOPPEL_API std::string to_markdown(const ValidationReport& report);

}  // namespace doppel
