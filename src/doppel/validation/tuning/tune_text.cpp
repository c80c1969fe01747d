// The report of gains as text.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/validation/motions/machine_run.h"
#include "doppel/validation/tuning/tune.h"

namespace doppel {
namespace {

double hertz_of(double w) {
  return w / (2 * std::numbers::pi);
}

std::string number(double value) {
  if (!std::isfinite(value)) return "unlimited";
  return fmt::format("{:.4g}", std::abs(value) < 1e-9 ? 0.0 : value);
}

std::string gains_text(const LoopGains& gains) {
  return fmt::format("p {} i {} d {}{}", number(gains.p), number(gains.i), number(gains.d),
                     std::isfinite(gains.clamp) ? " i_clamp +-" + number(gains.clamp) : "");
}

std::string step_text(const TunedJoint& joint, const WorstStep& step) {
  if (!step.judged) return "no step was possible";
  return fmt::format("overshoot {:.1f} %, settling {:.3f} s, error {}, peak effort {:.0f} %: {}{}",
                     100 * step.overshoot, step.settling, position_text(step.error, joint.slides),
                     100 * step.peak_effort, step.passed ? "passes" : "FAILS",
                     step.place.empty() ? "" : " (" + step.place + ")");
}

// Whether gains act, before all numbers.
std::string acting_text(const TuneReport& report) {
  std::string out;
  std::vector<std::string> seen;
  for (const TunedJoint& joint : report.joints) {
    if (joint.controller.empty() || std::ranges::find(seen, joint.controller) != seen.end()) continue;
    seen.push_back(joint.controller);
    if (joint.gains_act) {
      out += fmt::format("{} commands {}: its gains close the position loop and are tuned.\n",
                         joint.controller, joint.interface);
    } else if (joint.interface == "position") {
      out += fmt::format(
          "{} commands position: gains of a controller do nothing there. The servo's stiffness and damping "
          "act:\n",
          joint.controller);
      out += fmt::format("  {:24} {:>12} {:>12} {:>10} {:>12}\n", "joint", "stiffness", "damping",
                         "frequency", "J most");
      for (const TunedJoint& one : report.joints) {
        if (one.controller != joint.controller) continue;
        out += fmt::format("  {:24} {:>12} {:>12} {:>7.3g} Hz {:>12}\n", one.joint, number(one.stiffness),
                           number(one.damping), hertz_of(std::sqrt(one.stiffness / one.plant.most_inertia)),
                           number(one.plant.most_inertia));
      }
    } else {
      out += fmt::format("{} ({}) has no gains of a position loop that could be tuned.\n", joint.controller,
                         joint.type);
    }
  }
  for (const TunedJoint& joint : report.joints) {
    if (joint.controller.empty()) out += fmt::format("{} is in no active controller.\n", joint.joint);
  }
  return out;
}

std::string model_text(const TunedJoint& joint) {
  const JointPlant& plant = joint.plant;
  const std::string unit = joint.slides ? "kg" : "kg m^2", force = joint.slides ? "N" : "N m";
  return fmt::format(
      "  model      J {} to {} {}, damping {}, friction {}, gravity up to {} {}, delay {:.3g} ms\n",
      number(plant.least_inertia), number(plant.most_inertia), unit, number(plant.damping),
      number(plant.friction), number(plant.gravity), force, 1e3 * plant.delay);
}

std::string relay_text(const TunedJoint& joint) {
  if (!joint.relay) return "";
  const RelayCheck& relay = *joint.relay;
  if (!relay.refusal.empty()) return fmt::format("  relay      {}\n", relay.refusal);
  std::string out =
      fmt::format("  relay      K_u {}, T_u {:.4g} s (model with half a period of delay: {}, {:.4g} s)\n",
                  number(relay.relay.gain), relay.relay.period, number(relay.model.gain), relay.model.period);
  for (const RuleTrial& rule : relay.rules) {
    out += fmt::format("    {:16} {}: T4 at the start pose: {}\n", name_of(rule.rule), gains_text(rule.gains),
                       step_text(joint, rule.step));
  }
  return out;
}

std::string joint_text(const TunedJoint& joint, int runs) {
  std::string out = fmt::format("\n{}  ({}, {})\n", joint.joint, joint.controller, joint.interface);
  out += model_text(joint);
  out +=
      fmt::format("  old gains  {}\n", joint.old_gains ? gains_text(*joint.old_gains) : "none are written");
  out += fmt::format("    T4       {}\n", step_text(joint, joint.before));
  if (joint.design) {
    const LoopDesign& design = *joint.design;
    const double gain = design.gain_margin();
    out += fmt::format("  new gains  {}\n", gains_text(design.gains));
    out += fmt::format("    loop     {:.3g} Hz ({:.3g} rad/s), phase margin {:.0f} deg, gain margin {}\n",
                       hertz_of(design.bandwidth), design.bandwidth,
                       design.phase_margin() * 180 / std::numbers::pi,
                       std::isfinite(gain) ? fmt::format("{:.1f} dB", 20 * std::log10(gain)) : "unlimited");
    out += fmt::format("    T4       {}\n", step_text(joint, joint.after));
    out += fmt::format("    {} runs  {}\n", runs, step_text(joint, joint.perturbed));
    for (const WorstStep* step : {&joint.after, &joint.perturbed})
      if (!step->message.empty()) out += fmt::format("    fails    {}\n", step->message);
  }
  out += fmt::format("  not faster {}\n", joint.why_not_faster);
  if (joint.interface == "effort" && joint.plant.gravity > 1e-6) {
    out += fmt::format(
        "  gravity    a feed-forward of up to {} {} would leave the integral nothing to do; a trajectory "
        "controller has none\n",
        number(joint.plant.gravity), joint.slides ? "N" : "N m");
  }
  return out + relay_text(joint);
}

}  // namespace

std::string to_text(const TuneReport& report) {
  std::string out =
      fmt::format("gains of {}{}\n\n", report.robot,
                  report.payload > 0 ? fmt::format(" with {:.4g} kg at the tool", report.payload) : "");
  out += acting_text(report);
  for (const TunedJoint& joint : report.joints) {
    if (joint.gains_act) {
      out += joint_text(joint, report.runs);
    } else if (joint.before.judged && !joint.before.passed) {
      out += fmt::format("\n{}: T4 {}\n  {}\n", joint.joint, step_text(joint, joint.before),
                         joint.before.message);
    }
  }
  for (const std::string& note : report.notes) out += fmt::format("note: {}\n", note);
  const auto failed =
      std::ranges::count_if(report.joints, [](const TunedJoint& one) { return !one.passed(); });
  if (std::ranges::none_of(report.joints, [](const TunedJoint& one) { return one.after.judged; }))
    return out + "\nnothing to tune, and no joint makes a step\n";
  const char* const gains = report.any_gains_act() ? "the new gains" : "nothing to tune; the servos";
  if (failed == 0) {
    out += fmt::format(
        "\n{}: T4 passes{}\n", gains,
        report.runs > 0 ? fmt::format(", also in {} runs with masses, friction and delay +-20 %", report.runs)
                        : "");
  } else {
    out += fmt::format("\n{}: T4 FAILS for {} of {} joints\n", gains, failed, report.joints.size());
  }
  return out;
}

}  // namespace doppel
