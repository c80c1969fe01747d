#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "doppel/review/doctor/findings.h"

namespace doppel::doctor {
namespace {

using Json = nlohmann::ordered_json;

const char* colour_of(Level level) {
  if (level == Level::problem) return "\033[31m";
  return level == Level::note ? "\033[33m" : "\033[32m";
}

long count(const std::vector<Finding>& findings, Level level) {
  return std::ranges::count(findings, level, &Finding::level);
}

std::string times(long number, const char* noun) {
  return number == 0 ? fmt::format("no {}s", noun)
                     : fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

}  // namespace

std::string_view to_string(Level level) {
  if (level == Level::problem) return "problem";
  return level == Level::note ? "note" : "ok";
}

std::vector<Finding> judge(const Machine& machine) {
  std::vector<Finding> out;
  const auto add = [&out](std::vector<Finding> found) { std::ranges::move(found, std::back_inserter(out)); };
  add(judge_program(machine.program));
  add(judge_display(machine.display));
  add(judge_network(machine.network));
  add(judge_processor(machine.processor));
  add(judge_storage(machine.storage));
  add(judge_serial(machine.serial));
  return out;
}

bool has_problem(const std::vector<Finding>& findings) {
  return count(findings, Level::problem) > 0;
}

std::string report_text(const std::vector<Finding>& findings, bool coloured) {
  std::string out, subject;
  for (const Finding& finding : findings) {
    if (finding.subject != subject) out += fmt::format("{}{}\n", out.empty() ? "" : "\n", finding.subject);
    subject = finding.subject;
    out += fmt::format("  {}{:<7}{}  {}\n", coloured ? colour_of(finding.level) : "",
                       to_string(finding.level), coloured ? "\033[0m" : "", finding.what);
    if (!finding.why.empty()) out += fmt::format("           {}\n", finding.why);
    if (!finding.remedy.empty()) out += fmt::format("           fix: {}\n", finding.remedy);
  }
  return out + fmt::format("\n{}, {}{}\n", times(count(findings, Level::problem), "problem"),
                           times(count(findings, Level::note), "note"),
                           has_problem(findings) ? "" : ": nothing prevents `doppel up`");
}

std::string report_json(const Machine& machine, const std::vector<Finding>& findings) {
  Json out;
  out["version"] = 1;
  out["doppel"] = machine.program.version;
  out["ready"] = !has_problem(findings);
  out["findings"] = Json::array();
  for (const Finding& finding : findings) {
    Json entry;
    entry["level"] = to_string(finding.level);
    entry["subject"] = finding.subject;
    entry["name"] = finding.name;
    entry["what"] = finding.what;
    if (!finding.why.empty()) entry["why"] = finding.why;
    if (!finding.remedy.empty()) entry["fix"] = finding.remedy;
    out["findings"].push_back(std::move(entry));
  }
  // The environment may hold bytes that are not UTF-8.
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace doppel::doctor
