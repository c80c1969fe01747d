// The audit for machines: doppel's own JSON, SARIF 2.1.0 (OASIS standard, March 2020), GitHub's annotations.
#include <fmt/format.h>

#include <cctype>
#include <nlohmann/json.hpp>

#include "doppel/review/audit/audit.h"
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

// RFC 3986: what is not a path character is percent-encoded; an absolute path is a file URI.
std::string uri_of(const SourceLocation& where) {
  const std::string path = file_of(where);
  std::string out = path.starts_with('/') ? "file://" : "";
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = byte < 128 && (std::isalnum(byte) != 0 ||
                                      std::string_view("/._-~").find(c) != std::string_view::npos);
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return out;
}

Json physical_location(const SourceLocation& where) {
  Json region = Json::object();
  if (where.line > 0) region["startLine"] = where.line;
  if (where.column > 0) region["startColumn"] = where.column;
  Json out{{"artifactLocation", {{"uri", uri_of(where)}}}};
  if (!region.empty()) out["region"] = region;
  return out;
}

Json sarif_rule(const RuleInfo& rule) {
  return {{"id", rule.id},
          {"shortDescription", {{"text", rule.title}}},
          {"fullDescription", {{"text", rule.failure}}},
          {"help", {{"text", rule.fix}}},
          {"defaultConfiguration", {{"level", to_string(rule.severity)}}}};
}

Json sarif_result(const Finding& finding) {
  const auto& rules = rule_table();
  const RuleInfo* rule = find_rule(finding.rule);
  Json out{{"ruleId", finding.rule}};
  if (rule != nullptr) out["ruleIndex"] = rule - rules.data();
  out["level"] = to_string(finding.severity);
  out["message"] = {{"text", message_with_fix(finding)}};
  if (!finding.where.known()) return out;
  out["locations"] = Json::array({{{"physicalLocation", physical_location(finding.where)}}});
  Json related = Json::array();
  for (const auto* call : calls(finding.where)) {
    related.push_back({{"id", related.size() + 1},
                       {"message", {{"text", call->what}}},
                       {"physicalLocation", physical_location(call->call)}});
  }
  if (!related.empty()) out["relatedLocations"] = related;
  return out;
}

std::string escaped_for_github(const std::string& text, bool property) {
  std::string out;
  for (const char c : text) {
    if (c == '%')
      out += "%25";
    else if (c == '\r')
      out += "%0D";
    else if (c == '\n')
      out += "%0A";
    else if (property && c == ':')
      out += "%3A";
    else if (property && c == ',')
      out += "%2C";
    else
      out += c;
  }
  return out;
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
  Json rules = Json::array(), results = Json::array();
  for (const RuleInfo& rule : rule_table()) rules.push_back(sarif_rule(rule));
  for (const Finding& finding : report.findings) results.push_back(sarif_result(finding));
  const Json driver{{"name", "doppel"}, {"rules", rules}};
  const Json run{{"tool", {{"driver", driver}}}, {"columnKind", "unicodeCodePoints"}, {"results", results}};
  return dumped({{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
                 {"version", "2.1.0"},
                 {"runs", Json::array({run})}});
}

std::string to_github(const AuditReport& report) {
  std::string out;
  for (const Finding& f : report.findings) {
    const bool is_note = f.severity == Severity::note;
    std::string properties;
    const auto property = [&](const char* name, const std::string& value) {
      properties +=
          fmt::format("{}{}={}", properties.empty() ? " " : ",", name, escaped_for_github(value, true));
    };
    if (f.where.known()) property("file", *f.where.file);
    if (f.where.line > 0) property("line", std::to_string(f.where.line));
    if (f.where.column > 0) property("col", std::to_string(f.where.column));
    property("title", f.rule);
    out += fmt::format("::{}{}::{}\n", is_note ? "notice" : to_string(f.severity), properties,
                       escaped_for_github(message_with_fix(f), false));
  }
  return out;
}

}  // namespace doppel
