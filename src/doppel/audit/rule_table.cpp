// What each rule over the description itself is for. The parsers' rules: rule_table_parsers.cpp; those about
// ROS: rule_table_ros.cpp.
#include <algorithm>
#include <array>
#include <string>

#include "doppel/audit/rules_detail.h"

namespace doppel {
namespace audit_rules {
namespace {

constexpr Severity E = Severity::error, W = Severity::warning, N = Severity::note;

constexpr std::array<RuleInfo, 0> kRules{};

}  // namespace

std::span<const RuleInfo> description_rules() {
  return kRules;
}

}  // namespace audit_rules

const std::vector<RuleInfo>& rule_table() {
  static const std::vector<RuleInfo> rules = [] {
    std::vector<RuleInfo> all;
    for (const auto part :
         {audit_rules::description_rules(), audit_rules::parser_rules(), audit_rules::ros_rules()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    std::sort(all.begin(), all.end(), [](const RuleInfo& a, const RuleInfo& b) { return a.id < b.id; });
    return all;
  }();
  return rules;
}

const RuleInfo* find_rule(std::string_view id) {
  const std::vector<RuleInfo>& all = rule_table();
  const auto found = std::lower_bound(all.begin(), all.end(), id,
                                      [](const RuleInfo& r, std::string_view x) { return r.id < x; });
  return found == all.end() || found->id != id ? nullptr : &*found;
}

}  // namespace doppel
