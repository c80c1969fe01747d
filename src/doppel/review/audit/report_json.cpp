// The audit for machines: doppel's own JSON, SARIF and GitHub's annotations (code_scanning.h).
#include <nlohmann/json.hpp>

#include "doppel/review/audit/audit.h"
#include "doppel/review/audit/code_scanning.h"
#include "doppel/review/audit/detail/finding_text.h"
#include "doppel/review/audit/report_places.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

std::string file_of(const SourceLocation& where) {
  return where.known() ? *where.file : "";
}

Json stack_of(const SourceLocation& where) {
  Json out = Json::array();
  for (const auto* call : calls(where)) {
    out.push_back({{"what", call->what},
                   {"file", file_of(call->call)},
                   {"line", call->call.line},
                   {"column", call->call.column}});
  }
  return out;
}

std::string message_with_fix(const Finding& finding) {
  const std::string subject = finding.subject.empty() ? "" : finding.subject + ": ";
  const std::string fix = fix_of(finding);
  return subject + finding.message + (fix.empty() ? "" : "\nFix: " + fix);
}

// Messages may quote bytes of a broken file: what is not valid UTF-8 is replaced.
std::string dumped(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

ScannedResult scanned(const Finding& finding) {
  return {finding.rule, std::string(to_string(finding.severity)), message_with_fix(finding), finding.where};
}

}  // namespace

std::string to_json(const AuditReport& report) {
  Json findings = Json::array();
  for (const Finding& f : report.findings) {
    findings.push_back({{"rule", f.rule},
                        {"severity", to_string(f.severity)},
                        {"subject", f.subject},
                        {"message", f.message},
                        {"file", file_of(f.where)},
                        {"line", f.where.line},
                        {"column", f.where.column},
                        {"stack", stack_of(f.where)},
                        {"fix", fix_of(f)},
                        {"consequence", consequence_of(f)},
                        {"fixable", !f.repair.empty()}});
  }
  const Json counts{{"error", report.count(Severity::error)},
                    {"warning", report.count(Severity::warning)},
                    {"note", report.count(Severity::note)}};
  return dumped({{"version", 1},
                 {"robot", report.robot},
                 {"file", report.file.string()},
                 {"findings", findings},
                 {"counts", counts},
                 {"links", report.links},
                 {"joints", report.joints},
                 {"mass", report.mass}});
}

std::string to_sarif(const AuditReport& report) {
  std::vector<ScannedRule> rules;
  std::vector<ScannedResult> results;
  for (const RuleInfo& rule : rule_table()) {
    rules.push_back({std::string(rule.id), std::string(rule.title), std::string(rule.failure),
                     std::string(rule.fix), std::string(to_string(rule.severity))});
  }
  for (const Finding& finding : report.findings) results.push_back(scanned(finding));
  return sarif_text(rules, results);
}

std::string to_github(const AuditReport& report) {
  std::string out;
  for (const Finding& finding : report.findings) out += github_annotation(scanned(finding));
  return out;
}

}  // namespace doppel
