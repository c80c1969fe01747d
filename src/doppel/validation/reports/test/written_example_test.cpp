// The example in every form, for tests in other languages and for people: DOPPEL_EXAMPLE_REPORT names a
// folder.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "doppel/validation/reports/html_report.h"
#include "doppel/validation/reports/report_formats.h"
#include "doppel/validation/reports/results.h"
#include "doppel/validation/reports/test/example_report.h"

namespace doppel {
namespace {

TEST(WrittenExample, FilesAreWrittenWhereVariableNamesFolder) {
  const char* const folder = std::getenv("DOPPEL_EXAMPLE_REPORT");
  if (folder == nullptr) GTEST_SKIP() << "DOPPEL_EXAMPLE_REPORT names no folder";
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream stream(std::filesystem::path(folder) / name, std::ios::binary);
    stream << text;
    EXPECT_TRUE(stream.flush()) << name;
  };
  const Subject subject = reports_test::bundled_subject("omarm_one");
  ASSERT_TRUE(subject.refusal.empty()) << subject.refusal.front().str();
  const ValidationReport report = reports_test::example_report(&subject);
  write("results.json", to_json(report));
  write("bare.json", to_json(report, {.wall_clock = false}));
  write("junit.xml", to_junit(report));
  write("doppel.sarif", to_sarif(report));
  write("summary.md", to_markdown(report));
  write("index.html", html_report(report, &subject));
  write("report.txt", to_text(report, {}));
}

}  // namespace
}  // namespace doppel
