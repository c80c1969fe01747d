#include "doppel/review/audit/code_scanning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "doppel/review/audit/report_places.h"

namespace doppel {
namespace {

using SarifJson = nlohmann::ordered_json;

// RFC 3986: what is not a path character is percent-encoded; an absolute path is a file URI.
std::string uri_of(const SourceLocation& where) {
  const std::string path = where.known() ? *where.file : "";
  std::string out = path.starts_with('/') ? "file://" : "";
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = byte < 128 && (std::isalnum(byte) != 0 ||
                                      std::string_view("/._-~").find(c) != std::string_view::npos);
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return out;
}

SarifJson physical_location(const SourceLocation& where) {
  SarifJson region = SarifJson::object();
  if (where.line > 0) region["startLine"] = where.line;
  if (where.column > 0) region["startColumn"] = where.column;
  SarifJson out{{"artifactLocation", {{"uri", uri_of(where)}}}};
  if (!region.empty()) out["region"] = region;
  return out;
}

SarifJson sarif_result(const std::vector<ScannedRule>& rules, const ScannedResult& result) {
  SarifJson out{{"ruleId", result.rule}};
  const auto rule = std::ranges::find(rules, result.rule, &ScannedRule::id);
  if (rule != rules.end()) out["ruleIndex"] = rule - rules.begin();
  out["level"] = result.level;
  out["message"] = {{"text", result.message}};
  if (!result.waived.empty())
    out["suppressions"] = SarifJson::array({{{"kind", "external"}, {"justification", result.waived}}});
  if (!result.where.known()) return out;
  out["locations"] = SarifJson::array({{{"physicalLocation", physical_location(result.where)}}});
  SarifJson related = SarifJson::array();
  for (const auto* call : calls(result.where)) {
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

std::string sarif_text(const std::vector<ScannedRule>& rules, const std::vector<ScannedResult>& results) {
  SarifJson listed = SarifJson::array(), found = SarifJson::array();
  for (const ScannedRule& rule : rules) {
    listed.push_back({{"id", rule.id},
                      {"shortDescription", {{"text", rule.title}}},
                      {"fullDescription", {{"text", rule.failure}}},
                      {"help", {{"text", rule.fix}}},
                      {"defaultConfiguration", {{"level", rule.level}}}});
  }
  for (const ScannedResult& result : results) found.push_back(sarif_result(rules, result));
  const SarifJson driver{{"name", "doppel"}, {"rules", listed}};
  const SarifJson run{
      {"tool", {{"driver", driver}}}, {"columnKind", "unicodeCodePoints"}, {"results", found}};
  const SarifJson log{{"$schema", "https://json.schemastore.org/sarif-2.1.0.json"},
                      {"version", "2.1.0"},
                      {"runs", SarifJson::array({run})}};
  return log.dump(2, ' ', false, SarifJson::error_handler_t::replace) + "\n";
}

std::string github_annotation(const ScannedResult& result) {
  std::string properties;
  const auto property = [&](const char* name, const std::string& value) {
    properties +=
        fmt::format("{}{}={}", properties.empty() ? " " : ",", name, escaped_for_github(value, true));
  };
  if (result.where.known()) property("file", *result.where.file);
  if (result.where.line > 0) property("line", std::to_string(result.where.line));
  if (result.where.column > 0) property("col", std::to_string(result.where.column));
  property("title", result.rule);
  return fmt::format("::{}{}::{}\n", result.level == "note" ? "notice" : result.level, properties,
                     escaped_for_github(result.message, false));
}

}  // namespace doppel
