// Millimetres for metres, grams for kilograms: a habit of an exporter, so several links show it alike.
#include <algorithm>
#include <set>

#include "doppel/audit/detail/inertia_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr std::size_t kFewestLinks = 3;

bool alike(const UnitDoubt& a, const UnitDoubt& b) {
  return a.of == b.of && a.power == b.power;
}

// Copies of one placeholder agree with each other about nothing.
std::size_t different(const std::vector<const UnitDoubt*>& doubts) {
  std::set<std::pair<double, Components>> seen;
  for (const UnitDoubt* doubt : doubts)
    seen.emplace(doubt->link->inertial->mass, components_of(*doubt->link->inertial));
  return seen.size();
}

void report_agreed(const std::vector<const UnitDoubt*>& doubts, Findings& out) {
  std::vector<std::string> names;
  for (const UnitDoubt* doubt : doubts) names.push_back(doubt->link->name);
  const UnitDoubt& first = *doubts.front();
  out.add("inertia.units", first.power > 0 ? Severity::error : Severity::warning,
          fmt::format("{} links", names.size()), first.link->inertial->source,
          fmt::format("{}, and likewise in {}: they are {}", first.said,
                      names_of({names.begin() + 1, names.end()}), first.meant),
          "convert them to kg, m and kg m^2, or export them again in these units");
}

void report_alone(const UnitDoubt& doubt, Findings& out) {
  Finding& f = out.add("inertia.units", Severity::note, subject(*doubt.link), doubt.link->inertial->source,
                       fmt::format("{}; was it written {}?", doubt.said, doubt.meant),
                       "nothing, if it is a placeholder or the shape stands for something else");
  f.consequence = "if it is a slip of units, the link turns and falls like another body";
}

}  // namespace

void report_units(const UnitDoubts& doubts, Findings& out) {
  std::vector<const UnitDoubt*> waiting;
  for (const UnitDoubt& doubt : doubts.all) waiting.push_back(&doubt);
  while (!waiting.empty()) {
    const UnitDoubt& first = *waiting.front();
    const auto others = std::stable_partition(waiting.begin(), waiting.end(),
                                              [&](const UnitDoubt* d) { return alike(*d, first); });
    const std::vector<const UnitDoubt*> group(waiting.begin(), others);
    waiting.erase(waiting.begin(), others);
    if (different(group) >= kFewestLinks && 2 * group.size() > doubts.judged) {
      report_agreed(group, out);
    } else {
      for (const UnitDoubt* doubt : group) report_alone(*doubt, out);
    }
  }
}

}  // namespace doppel::audit_rules
