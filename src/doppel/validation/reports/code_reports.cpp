// A validation beside the code: SARIF, GitHub's annotations and Markdown.
#include <algorithm>

#include "doppel/review/audit/code_scanning.h"
#include "doppel/validation/reports/detail/report_parts.h"
#include "doppel/validation/reports/report_formats.h"

namespace doppel {
namespace {

std::string level_of(Verdict verdict, bool strict) {
  if (is_failure(verdict, strict)) return "error";
  return verdict == Verdict::warned ? "warning" : "note";
}

ScannedResult scanned(const ValidationReport& report, const CheckResult& check, const CheckItem& item) {
  ScannedResult out;
  out.rule = check.id;
  out.level = level_of(item.verdict, report.strict);
  out.message = sentence_of(item) + (item.fix.empty() ? "" : "\nFix: " + item.fix);
  out.where = item.where;
  if (item.verdict == Verdict::waived) out.waived = item.message;
  return out;
}

// For a cell of a table, or a line.
std::string in_markdown(std::string_view text) {
  std::string out;
  for (const char c : markup(text)) {
    if (c == '\n' || c == '\r') {
      out += ' ';
    } else {
      if (std::string_view("|*_`[]\\~").find(c) != std::string_view::npos) out += '\\';
      out += c;
    }
  }
  return out;
}

std::string_view mark_of(Verdict verdict, bool strict) {
  if (is_failure(verdict, strict)) return "\u274c";
  switch (verdict) {
    case Verdict::passed:
      return "\u2705";
    case Verdict::warned:
    case Verdict::waived:
      return "\u26a0\ufe0f";
    case Verdict::not_judged:
      return "\u2753";
    default:
      return "\u2796";
  }
}

std::string item_markdown(const CheckResult& check, const CheckItem& item) {
  std::string out = "- ";
  if (!item.subject.empty()) out += "**" + in_markdown(item.subject) + "**: ";
  if (item.verdict != check.verdict) out += fmt::format("{}: ", to_string(item.verdict));
  out += in_markdown(item.message);
  if (!item.fix.empty()) out += "<br>Fix: " + in_markdown(item.fix);
  if (item.where.known()) out += "<br><code>" + markup(item.where.place()) + "</code>";
  return out + "\n";
}

std::string details(const std::string& summary, const std::string& content, bool is_open) {
  return fmt::format("\n<details{}>\n<summary>{}</summary>\n\n{}\n</details>\n", is_open ? " open" : "",
                     summary, content);
}

std::string check_details(const ValidationReport& report, const CheckResult& check) {
  std::string items;
  for (const CheckItem& item : check.items) {
    if (is_notable(item)) items += item_markdown(check, item);
  }
  if (items.empty()) return "";
  return details(fmt::format("{} <b>{} {}</b>: {}", mark_of(check.verdict, report.strict), markup(check.id),
                             markup(check.title), to_string(check.verdict)),
                 items, is_failure(check.verdict, report.strict));
}

std::string metrics_markdown(const ValidationReport& report) {
  std::string rows;
  for (const CheckResult& check : report.checks) {
    for (const Metric& metric : check.metrics) {
      rows += fmt::format("| {} | {} | {} | {} | {} | {} |\n", in_markdown(check.id),
                          in_markdown(metric.subject), in_markdown(metric.name), number_text(metric.value),
                          metric.limit ? number_text(*metric.limit) : "", in_markdown(metric.unit));
    }
  }
  if (rows.empty()) return "";
  return details("All numbers",
                 "| check | of | number | value | limit | unit |\n|---|---|---|--:|--:|---|\n" + rows, false);
}

}  // namespace

std::string to_sarif(const ValidationReport& report) {
  std::vector<ScannedRule> rules;
  for (const CheckInfo& info : check_table()) {
    const std::string limit = info.limit.empty() ? "" : " Limit: " + std::string(info.limit) + ".";
    rules.push_back({std::string(info.id), std::string(info.title),
                     std::string(info.decided_by) + "." + limit,
                     "doppel validate --only " + std::string(info.id), "error"});
  }
  std::vector<ScannedResult> results;
  for (const CheckResult& check : report.checks) {
    for (const CheckItem& item : check.items) {
      if (is_notable(item) && item.where.known()) results.push_back(scanned(report, check, item));
    }
  }
  return sarif_text(rules, results);
}

std::string to_github(const ValidationReport& report) {
  std::string out;
  for (const CheckResult& check : report.checks) {
    bool is_explained = false;
    for (const CheckItem& item : check.items) {
      if (item.verdict != Verdict::warned && !is_failure(item.verdict, report.strict)) continue;
      ScannedResult result = scanned(report, check, item);
      result.rule += " " + check.title;
      out += github_annotation(result);
      is_explained = is_explained || item.verdict == check.verdict;
    }
    if (!is_explained && is_failure(check.verdict, report.strict))
      out += github_annotation({check.id + " " + check.title, "error", check.summary, {}});
  }
  for (const Regression& regression : report.regressions)
    out += github_annotation({"worse than before", "error", regression_text(regression), {}});
  return out;
}

std::string to_markdown(const ValidationReport& report) {
  std::string out =
      fmt::format("### {} doppel validate: {}\n\n**{}**\n\n", report.passed() ? "\u2705" : "\u274c",
                  in_markdown(report.robot), in_markdown(headline(report)));
  for (const Regression& regression : report.regressions)
    out += "- \u274c worse than before: " + in_markdown(regression_text(regression)) + "\n";
  for (const Regression& improvement : report.improvements)
    out += "- \u2705 better than before: " + in_markdown(improvement_text(improvement)) + "\n";
  out += "\n| | check | | result |\n|---|---|---|---|\n";
  for (const CheckResult& check : report.checks)
    out += fmt::format("| {} | {} | {} | {}: {} |\n", mark_of(check.verdict, report.strict),
                       in_markdown(check.id), in_markdown(check.title), to_string(check.verdict),
                       in_markdown(check.summary));
  for (const CheckResult& check : report.checks) out += check_details(report, check);
  out += metrics_markdown(report);
  for (const std::string& note : report.notes) out += "\n> " + in_markdown(note) + "\n";
  out += fmt::format("\n<sub>doppel {}, {}, seed {}, {}</sub>\n", markup(report.version),
                     markup(report.engine), report.seed, effort_text(report.effort));
  return out;
}

}  // namespace doppel
