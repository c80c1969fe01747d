// A verification as text and as JSON.

#include "doppel/lab/verification/detail/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "doppel/lab/verification/verify.h"
#include "doppel/physics/contract/step_scheme.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

std::string errors_of(const MotionVerdict& motion) {
  const bool turns = std::any_of(motion.joints.begin(), motion.joints.end(),
                                 [](const JointError& joint) { return !joint.slides; });
  const bool slides = std::any_of(motion.joints.begin(), motion.joints.end(),
                                  [](const JointError& joint) { return joint.slides; });
  std::string out;
  if (turns) out = size_of(motion.largest(false), "rad");
  if (slides) out += (turns ? " and " : "") + size_of(motion.largest(true), "m");
  return out + fmt::format(" (tool {})", size_of(motion.tool_largest, "m"));
}

std::string step_text(double step) {
  return fmt::format("{:g} ms", step * 1e3);
}

std::string table_of(const Verification& of, const MotionVerdict& motion) {
  std::string out = fmt::format("{}: {}\n", name_of(motion.kind), description_of(motion.kind));
  std::size_t width = of.tool.size() + 5;
  for (const JointError& joint : motion.joints) width = std::max(width, joint.joint.size());
  out += fmt::format("  {:<{}}  {:>13}  {:>12}\n", "error at " + step_text(of.step), width, "largest",
                     "at the end");
  const auto row = [&](const std::string& name, double largest, double end, const char* unit) {
    out += fmt::format("  {:<{}}  {:>13}  {:>12}\n", name, width, size_of(largest, unit), size_of(end, unit));
  };
  for (const JointError& joint : motion.joints)
    row(joint.joint, joint.largest, joint.at_end, joint.slides ? "m" : "rad");
  row("tool " + of.tool, motion.tool_largest, motion.tool_at_end, "m");
  out += motion.order ? fmt::format("  observed order {:.2f}, nominal order {}", *motion.order,
                                    step_scheme(of.integrator).order)
                      : std::string("  order not observable: the differences are rounding");
  if (motion.energy_drift)
    out += fmt::format("; energy drifts by {:.1e} of the motion's", *motion.energy_drift);
  if (motion.touches_after) {
    out +=
        fmt::format("\n  contact after {:.2f} s: from then on the order is at most 1", *motion.touches_after);
  }
  if (motion.runs_away_after)
    out += fmt::format("\n  diverges {:.2f} s after the start", *motion.runs_away_after);
  if (motion.chaotic_after) {
    out += fmt::format(
        "\n  chaotic after {:.2f} s: an initial change of {:g} has grown to {:g}, and no step reproduces it",
        *motion.chaotic_after, kPerturbation, kPerturbation * kChaoticGrowth);
  }
  return out + "\n";
}

Json optional_number(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

}  // namespace

std::string size_of(double value, const char* unit) {
  static constexpr struct {
    double size;
    const char* prefix;
  } kUnits[] = {{1.0, ""}, {1e-3, "m"}, {1e-6, "u"}, {1e-9, "n"}, {1e-12, "p"}};
  for (const auto& [size, prefix] : kUnits) {
    if (!(value >= 0.995 * size)) continue;
    const double scaled = value / size,
                 tens = scaled >= 99.5 ? std::pow(10, std::floor(std::log10(scaled)) - 1) : 1;
    return fmt::format("{} {}{}",
                       scaled < 9.95 ? fmt::format("{:.1f}", scaled)
                                     : fmt::format("{:.0f}", std::round(scaled / tens) * tens),
                       prefix, unit);
  }
  return fmt::format("0 {}", unit);
}

std::string verdict_line(const Verification& of, const MotionVerdict& motion) {
  if (motion.joints.empty()) return fmt::format("{:<7} nothing moves", name_of(motion.kind));
  std::string out = fmt::format("{:<7} {} is accurate to ", name_of(motion.kind), step_text(of.step));
  const double span = std::round(motion.span * 100) / 100;
  if (std::max(motion.largest(false), motion.largest(true)) > kLost) {
    out += fmt::format("{} for {:.2f} s, then the motions differ", size_of(kStillGood, "rad"),
                       motion.good_until);
  } else {
    out += fmt::format("{} over {:g} s", errors_of(motion), span);
  }
  if (motion.order && *motion.order < kMinSeenOrder) out += "; a shorter step does not reduce the error";
  if (motion.touches_after) out += fmt::format("; contact after {:.2f} s", *motion.touches_after);
  if (motion.runs_away_after) return out + fmt::format("; diverges after {:.2f} s", *motion.runs_away_after);
  if (motion.chaotic_after) out += fmt::format("; chaotic after {:.2f} s", *motion.chaotic_after);
  return out;
}

std::string verification_text(const Verification& of) {
  std::string out =
      fmt::format("{} in world '{}': {}, steps of {:g}, {:g} and {:g} ms over {:g} s\n\n", of.robot, of.world,
                  name_of(of.integrator), of.step * 1e3, of.step * 500, of.step * 250, of.duration);
  for (const MotionVerdict& motion : of.motions) out += table_of(of, motion) + "\n";
  for (const MotionVerdict& motion : of.motions) out += verdict_line(of, motion) + "\n";
  return out;
}

std::string verification_json(const Verification& of) {
  Json out{{"version", 1},
           {"robot", of.robot},
           {"world", of.world},
           {"integrator", name_of(of.integrator)},
           {"order", step_scheme(of.integrator).order},
           {"step", of.step},
           {"duration", of.duration},
           {"tool", of.tool},
           {"motions", Json::array()}};
  for (const MotionVerdict& motion : of.motions) {
    Json entry{{"name", name_of(motion.kind)}};
    entry["verdict"] = verdict_line(of, motion);
    entry["joints"] = Json::array();
    for (const JointError& joint : motion.joints) {
      entry["joints"].push_back({{"name", joint.joint},
                                 {"unit", joint.slides ? "m" : "rad"},
                                 {"largest", joint.largest},
                                 {"at_end", joint.at_end}});
    }
    entry["tool"] = {{"largest", motion.tool_largest}, {"at_end", motion.tool_at_end}};
    entry["order"] = optional_number(motion.order);
    entry["energy_drift"] = optional_number(motion.energy_drift);
    entry["chaotic_after"] = optional_number(motion.chaotic_after);
    entry["touches_after"] = optional_number(motion.touches_after);
    entry["span"] = motion.span;
    entry["good_until"] = motion.good_until;
    entry["runs_away_after"] = optional_number(motion.runs_away_after);
    out["motions"].push_back(std::move(entry));
  }
  return out.dump(2) + "\n";
}

}  // namespace doppel
