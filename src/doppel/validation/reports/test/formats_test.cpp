#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "doppel/review/audit/text_layout.h"
#include "doppel/validation/reports/html_report.h"
#include "doppel/validation/reports/report_formats.h"
#include "doppel/validation/reports/test/example_report.h"

namespace doppel {
namespace {

using reports_test::example_report;
using testing::HasSubstr;
using testing::Not;

ValidationReport passing_report() {
  ValidationReport out = example_report();
  std::erase_if(out.checks, [](const CheckResult& check) { return check.verdict > Verdict::not_judged; });
  return out;
}

TEST(ReportFormats, HeadlineCountsGatesAndTestsOrNamesFailures) {
  EXPECT_EQ(headline(example_report()),
            "failed: G14, T4; not run: T6; warning: G06; not judged: G03; waived: G05");
  EXPECT_EQ(headline(passing_report()),
            "passed: 4 gates, 1 test; warning: G06; not judged: G03; waived: G05; not applicable: T5");
  ValidationReport strict = passing_report();
  strict.strict = true;
  EXPECT_EQ(headline(strict), "failed by --strict; warning: G06; not judged: G03; waived: G05");
  ValidationReport ended;
  ended.complete = false;
  EXPECT_EQ(headline(ended), "ended before all checks had run");
}

TEST(ReportFormats, TextKeepsWidthAndHasNoControlSequences) {
  for (const int width : {60, 80, 100, 140}) {
    std::istringstream lines(to_text(example_report(), {.colour = false, .width = width}));
    for (std::string line; std::getline(lines, line);) {
      EXPECT_LE(display_width(line), static_cast<std::size_t>(width)) << line;
      EXPECT_EQ(line.find('\x1b'), std::string::npos) << line;
    }
  }
}

TEST(ReportFormats, TextHasFixAndPlaceBelowFailure) {
  const std::string text = to_text(example_report(), {});
  EXPECT_THAT(text, HasSubstr("failed          T4   Step response"));
  EXPECT_THAT(text, HasSubstr("fix: lower the gain p"));
  EXPECT_THAT(text, HasSubstr("controllers.yaml:14:7"));
  EXPECT_THAT(text, HasSubstr("0.1 % of 1000 poses missed"));
  EXPECT_THAT(text, Not(HasSubstr("settling 0.31 s")));  // it passes
  EXPECT_THAT(to_text(example_report(), {.colour = true}), HasSubstr("\x1b[1;31mfailed"));
}

TEST(ReportFormats, QuietTextHasFailuresAndLastLineOnly) {
  const std::string text = to_text(example_report(), {.failures_only = true});
  EXPECT_THAT(text, HasSubstr("G14"));
  EXPECT_THAT(text, HasSubstr("T6"));
  EXPECT_THAT(text, Not(HasSubstr("Origin of the description")));
  const std::string passed = to_text(passing_report(), {.width = 200, .failures_only = true});
  EXPECT_EQ(std::ranges::count(passed, '\n'), 1);
}

TEST(ReportFormats, JunitCountsEqualItsElements) {
  const std::string xml = to_junit(example_report());
  const auto count = [&xml](const std::string& word) {
    std::size_t out = 0;
    for (std::size_t i = xml.find(word); i != std::string::npos; i = xml.find(word, i + 1)) ++out;
    return out;
  };
  EXPECT_EQ(count("<failure"), 2U);
  EXPECT_EQ(count("<skipped"), 3U);
  EXPECT_EQ(count("<testcase"), 11U);
  EXPECT_THAT(xml, HasSubstr("tests=\"11\" failures=\"2\" errors=\"0\" skipped=\"3\" time=\"41.300\""));
  EXPECT_THAT(xml, HasSubstr("fix: lower the gain p"));
  EXPECT_THAT(xml, HasSubstr("name=\"Revolute 2: settling [s]\" value=\"0.62\""));
  EXPECT_EQ(xml.find('\x1b'), std::string::npos);
}

TEST(ReportFormats, JunitOfStrictRunAndOfRegressionsHasTheirFailures) {
  ValidationReport report = passing_report();
  report.strict = true;
  report.regressions = {{"T4", {"settling", "Revolute 2", 0.55, "s", 0.5}, 0.4}};
  const std::string xml = to_junit(report);
  EXPECT_THAT(xml, HasSubstr("failures=\"3\""));
  EXPECT_THAT(xml, HasSubstr("<failure type=\"not_judged\""));
  EXPECT_THAT(xml, HasSubstr("T4: settling of Revolute 2 0.55 s, before 0.4 s (+37.5 %)"));
}

TEST(ReportFormats, SarifHasFailuresWithPlaceAndWaiverAsSuppression) {
  const nlohmann::json sarif = nlohmann::json::parse(to_sarif(example_report()));
  const auto& run = sarif["runs"][0];
  const auto& rules = run["tool"]["driver"]["rules"];
  ASSERT_EQ(run["results"].size(), 4U);
  std::size_t waived = 0;
  for (const auto& result : run["results"]) {
    EXPECT_EQ(rules[result["ruleIndex"].get<std::size_t>()]["id"], result["ruleId"]);
    EXPECT_GE(result["locations"][0]["physicalLocation"]["region"]["startLine"], 1);
    waived += result.contains("suppressions") ? 1U : 0U;
  }
  EXPECT_EQ(waived, 1U);
}

TEST(ReportFormats, BetterNumbersAreInTextHtmlAndMarkdown) {
  ValidationReport report = passing_report();
  EXPECT_THAT(to_text(report, {}), Not(HasSubstr("better")));
  EXPECT_THAT(html_report(report, nullptr), Not(HasSubstr("Better than before")));
  report.improvements = {{"T4", {"settling", "Revolute 2", 0.22, "s", 0.5}, 0.31}};
  const std::string line = "T4: settling of Revolute 2 0.31 -> 0.22 s";
  EXPECT_THAT(to_text(report, {}), HasSubstr("better " + line));
  EXPECT_THAT(to_markdown(report), HasSubstr("better than before: "));
  EXPECT_THAT(html_report(report, nullptr), HasSubstr("T4: settling of Revolute 2 0.31 -&gt; 0.22 s"));
}

TEST(ReportFormats, HeadlineOfRunWithoutJudgementSaysSo) {
  ValidationReport report;
  EXPECT_EQ(headline(report), "no check was chosen");
  report.checks.push_back(not_applicable("T1", "there is no arm"));
  EXPECT_EQ(headline(report), "nothing of the machine could be judged; not applicable: T1");
}

TEST(ReportFormats, GithubAnnotationsAreSingleLines) {
  ValidationReport report = example_report();
  report.regressions = {{"T4", {"settling", "Revolute 2", 0.55, "s", 0.5}, 0.4}};
  const std::string text = to_github(report);
  EXPECT_EQ(std::ranges::count(text, '\n'), 5);
  EXPECT_THAT(text,
              HasSubstr("::error file=robots/omarm_one/config/controllers.yaml,line=14,col=7,title=T4"));
  EXPECT_THAT(text, HasSubstr("::warning file="));
  EXPECT_THAT(text, HasSubstr("title=T6 Drop test::not run: G11"));
}

TEST(ReportFormats, MarkdownHasTableAndDetailsThatNamesCannotBreak) {
  ValidationReport report = example_report();
  report.checks.front().summary = reports_test::kHardName;
  const std::string text = to_markdown(report);
  EXPECT_THAT(text, HasSubstr("<details open>\n<summary>\u274c <b>T4 Step response</b>: failed</summary>"));
  EXPECT_THAT(text, HasSubstr("a &lt;b&gt; &amp; "));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.find("| G01 |") == std::string::npos) continue;
    std::size_t bars = 0;
    for (std::size_t i = 0; i < line.size(); ++i) bars += line[i] == '|' && (i == 0 || line[i - 1] != '\\');
    EXPECT_EQ(bars, 5U) << line;
  }
}

}  // namespace
}  // namespace doppel
