// The report of gains as JSON.

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "doppel/validation/tuning/tune.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

Json json_number(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

Json gains_json(const LoopGains& gains) {
  return {{"p", gains.p}, {"i", gains.i}, {"d", gains.d}, {"i_clamp", json_number(gains.clamp)}};
}

Json step_json(const WorstStep& step) {
  if (!step.judged) return nullptr;
  Json out = {{"passed", step.passed}, {"overshoot", step.overshoot},     {"settling", step.settling},
              {"error", step.error},   {"peak_effort", step.peak_effort}, {"use", step.use},
              {"worst_at", step.place}};
  if (!step.message.empty()) out["why"] = step.message;
  return out;
}

Json relay_json(const RelayCheck& relay) {
  if (!relay.refusal.empty()) return {{"refusal", relay.refusal}};
  Json out = {{"ultimate_gain", relay.relay.gain},
              {"ultimate_period", relay.relay.period},
              {"model_ultimate_gain", relay.model.gain},
              {"model_ultimate_period", relay.model.period}};
  for (const RuleTrial& rule : relay.rules) {
    out["rules"].push_back(
        {{"rule", name_of(rule.rule)}, {"gains", gains_json(rule.gains)}, {"step", step_json(rule.step)}});
  }
  return out;
}

Json joint_json(const TunedJoint& joint) {
  const JointPlant& plant = joint.plant;
  Json out = {
      {"joint", joint.joint},
      {"controller", joint.controller},
      {"type", joint.type},
      {"interface", joint.interface},
      {"gains_act", joint.gains_act},
      {"servo", {{"stiffness", json_number(joint.stiffness)}, {"damping", json_number(joint.damping)}}},
      {"model",
       {{"least_inertia", plant.least_inertia},
        {"most_inertia", plant.most_inertia},
        {"damping", plant.damping},
        {"friction", plant.friction},
        {"gravity", plant.gravity},
        {"delay", plant.delay},
        {"effort", json_number(plant.effort)},
        {"speed", json_number(plant.speed)}}},
      {"passed", joint.passed()},
      {"old",
       {{"gains", joint.old_gains ? gains_json(*joint.old_gains) : Json()},
        {"step", step_json(joint.before)}}}};
  if (joint.design) {
    const LoopDesign& design = *joint.design;
    out["new"] = {
        {"gains", gains_json(design.gains)},     {"bandwidth", design.bandwidth / (2 * std::numbers::pi)},
        {"phase_margin", design.phase_margin()}, {"gain_margin", json_number(design.gain_margin())},
        {"step", step_json(joint.after)},        {"perturbed", step_json(joint.perturbed)}};
  }
  if (!joint.why_not_faster.empty()) out["why_not_faster"] = joint.why_not_faster;
  if (joint.relay) out["relay"] = relay_json(*joint.relay);
  return out;
}

}  // namespace

std::string to_json(const TuneReport& report) {
  Json out = {{"schema", "doppel.tune/1"}, {"robot", report.robot},     {"target", report.target},
              {"version", report.version}, {"payload", report.payload}, {"runs", report.runs},
              {"passed", report.passed()}, {"notes", report.notes},     {"joints", Json::array()}};
  for (const TunedJoint& joint : report.joints) out["joints"].push_back(joint_json(joint));
  return out.dump(2) + "\n";
}

}  // namespace doppel
