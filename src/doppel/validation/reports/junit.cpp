// JUnit's XML as Jenkins, GitLab and pytest read it (the schema of Jenkins' xunit plugin).
#include <map>

#include "doppel/validation/reports/detail/report_parts.h"
#include "doppel/validation/reports/report_formats.h"
#include "doppel/validation/reports/results.h"

namespace doppel {
namespace {

struct JunitCase {
  std::string name;
  Verdict verdict = Verdict::passed;
  std::string message;  // one line
  std::string text;     // number, limit, cause, fix, place
};

std::string text_of(const CheckResult& check, const CheckItem& item) {
  std::string out = sentence_of(item);
  if (!check.summary.empty()) out += "\nresult: " + check.summary;
  if (const CheckInfo* const info = find_check(check.id)) out += "\nlimit: " + std::string(info->limit);
  if (!item.fix.empty()) out += "\nfix: " + item.fix;
  if (item.where.known()) out += "\nat: " + item.where.str();
  return out;
}

// A case for each item, and one for the check if no item has its verdict. Equal names get a number.
std::vector<JunitCase> cases_of(const CheckResult& check) {
  std::vector<JunitCase> out;
  bool is_explained = false;
  std::map<std::string, int> used;
  const auto add = [&](const std::string& name, Verdict verdict, const CheckItem& item) {
    const int times = ++used[name];
    out.push_back({times == 1 ? name : fmt::format("{} ({})", name, times), verdict, sentence_of(item),
                   text_of(check, item)});
  };
  for (const CheckItem& item : check.items) {
    add(item.subject.empty() ? check.title : item.subject, item.verdict, item);
    is_explained = is_explained || item.verdict == check.verdict;
  }
  if (!is_explained) {
    CheckItem whole;
    whole.message = check.summary;
    add(check.title, check.verdict, whole);
  }
  return out;
}

bool is_skip(Verdict verdict, bool strict) {
  return verdict == Verdict::not_applicable || verdict == Verdict::not_run ||
         (verdict == Verdict::not_judged && !strict);
}

std::string case_xml(const std::string& class_name, const JunitCase& one, bool strict) {
  std::string out =
      fmt::format("    <testcase classname=\"{}\" name=\"{}\">", markup(class_name), markup(one.name));
  if (is_skip(one.verdict, strict)) {
    out += fmt::format("<skipped message=\"{}: {}\"/>", to_string(one.verdict), markup(one.message));
  } else if (is_failure(one.verdict, strict)) {
    out += fmt::format("<failure type=\"{}\" message=\"{}\">{}</failure>", verdict_key(one.verdict),
                       markup(one.message), markup(one.text));
  } else if (one.verdict != Verdict::passed) {
    out += fmt::format("<system-out>{}: {}</system-out>", to_string(one.verdict), markup(one.text));
  }
  return out + "</testcase>\n";
}

std::string properties_xml(const CheckResult& check) {
  std::string out;
  const auto property = [&out](const std::string& name, const std::string& value) {
    out += fmt::format("      <property name=\"{}\" value=\"{}\"/>\n", markup(name), markup(value));
  };
  property("verdict", verdict_key(check.verdict));
  if (!check.summary.empty()) property("summary", check.summary);
  for (const Metric& metric : check.metrics) {
    std::string name = metric.subject.empty() ? metric.name : metric.subject + ": " + metric.name;
    if (!metric.unit.empty()) name += " [" + metric.unit + "]";
    property(name, fmt::format("{:.9g}", metric.value));
    if (metric.limit) property(name + " limit", fmt::format("{:.9g}", *metric.limit));
  }
  return "    <properties>\n" + out + "    </properties>\n";
}

struct JunitCounts {
  std::size_t tests = 0, failures = 0, skipped = 0;
};

std::string attributes(const JunitCounts& counts, double seconds) {
  return fmt::format("tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"{}\" time=\"{:.3f}\"", counts.tests,
                     counts.failures, counts.skipped, seconds);
}

std::string suite_xml(const ValidationReport& report, const CheckResult& check, JunitCounts& total) {
  JunitCounts counts;
  std::string cases;
  for (const JunitCase& one : cases_of(check)) {
    ++counts.tests;
    const bool skipped = is_skip(one.verdict, report.strict);
    if (skipped) ++counts.skipped;
    if (!skipped && is_failure(one.verdict, report.strict)) ++counts.failures;
    cases += case_xml(report.robot + "." + check.id, one, report.strict);
  }
  total.tests += counts.tests;
  total.failures += counts.failures;
  total.skipped += counts.skipped;
  return fmt::format("  <testsuite name=\"{}\" {}>\n", markup(check.id + " " + check.title),
                     attributes(counts, check.seconds)) +
         properties_xml(check) + cases + "  </testsuite>\n";
}

// The comparison with a baseline, as a check.
CheckResult baseline_check(const ValidationReport& report) {
  CheckResult out;
  out.id = "baseline";
  out.title = "not worse than before";
  for (const Regression& regression : report.regressions) {
    const Metric& metric = regression.metric;
    out.fail(fmt::format("{} {}{}", regression.check, metric.name,
                         metric.subject.empty() ? "" : " of " + metric.subject),
             regression_text(regression));
  }
  return out;
}

}  // namespace

std::string to_junit(const ValidationReport& report) {
  JunitCounts total;
  std::string suites;
  for (const CheckResult& check : report.checks) suites += suite_xml(report, check, total);
  if (!report.regressions.empty()) suites += suite_xml(report, baseline_check(report), total);
  return fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\" {}>\n",
                     markup("doppel validate " + report.target), attributes(total, report.seconds)) +
         suites + "</testsuites>\n";
}

}  // namespace doppel
