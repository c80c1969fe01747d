// Millimetres for metres, grams for kilograms: an exporter does this in all links, so several agree.
#include <algorithm>
#include <set>

#include "doppel/review/audit/detail/inertia_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr std::size_t kMinLinks = 3;

bool alike(const SuspectUnit& a, const SuspectUnit& b) {
  return a.of == b.of && a.power == b.power;
}

// Copies of one placeholder count once: their agreement proves nothing.
std::size_t different(const std::vector<const SuspectUnit*>& suspects) {
  std::set<std::pair<double, Components>> seen;
  for (const SuspectUnit* suspect : suspects)
    seen.emplace(suspect->link->inertial->mass, components_of(*suspect->link->inertial));
  return seen.size();
}

void report_agreed(const std::vector<const SuspectUnit*>& suspects, Findings& out) {
  std::vector<std::string> names;
  for (const SuspectUnit* suspect : suspects) names.push_back(suspect->link->name);
  const SuspectUnit& first = *suspects.front();
  out.add("inertia.units", first.power > 0 ? Severity::error : Severity::warning,
          fmt::format("{} links", names.size()), first.link->inertial->source,
          fmt::format("{}, and likewise in {}: they are {}", first.values,
                      names_of({names.begin() + 1, names.end()}), first.meant),
          "convert them to kg, m and kg m^2, or export them again in these units");
}

void report_alone(const SuspectUnit& suspect, Findings& out) {
  Finding& f =
      out.add("inertia.units", Severity::note, subject(*suspect.link), suspect.link->inertial->source,
              fmt::format("{}; is it written {}?", suspect.values, suspect.meant),
              "nothing, if it is a placeholder or the shape is only representative");
  f.consequence = "if the unit is wrong, the link moves like another body";
}

}  // namespace

void report_units(const SuspectUnits& suspects, Findings& out) {
  std::vector<const SuspectUnit*> waiting;
  for (const SuspectUnit& suspect : suspects.all) waiting.push_back(&suspect);
  while (!waiting.empty()) {
    const SuspectUnit& first = *waiting.front();
    const auto others = std::stable_partition(waiting.begin(), waiting.end(),
                                              [&](const SuspectUnit* d) { return alike(*d, first); });
    const std::vector<const SuspectUnit*> group(waiting.begin(), others);
    waiting.erase(waiting.begin(), others);
    if (different(group) >= kMinLinks && 2 * group.size() > suspects.compared) {
      report_agreed(group, out);
    } else {
      for (const SuspectUnit* suspect : group) report_alone(*suspect, out);
    }
  }
}

}  // namespace doppel::audit_rules
