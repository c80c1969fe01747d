#include <algorithm>
#include <cmath>

#include "doppel/validation/statics/start_pose.h"
#include "doppel/validation/tuning/detail/joint_plants.h"
#include "doppel/validation/tuning/detail/tuning_twin.h"

namespace doppel {
namespace {

constexpr const char* kRelayClient = "/doppel_tune";
constexpr double kSettling = 1.5, kMaxRecord = 6, kPart = 0.5;  // s
constexpr double kFarthest = 0.4, kFarthestSlide = 0.05;        // rad, m: no limit cycle beyond
constexpr double kMaxSpread = 0.1;                              // of the period
constexpr double kEffortShare = 0.2, kSpeedShare = 0.3;         // of the limit: the relay's amplitude
constexpr double kHuge = 1e9;  // a gain with which the clamped command has two values

// The records of a relay in place of the joint's controller.
struct RelayRecord {
  std::vector<double> time, position;
  bool escaped = false;
};

void set_gains(Edge& edge, const TunedJoint& joint,
               const std::vector<std::pair<const char*, double>>& gains) {
  for (const auto& [name, value] : gains) {
    edge.set_parameter("/" + joint.controller, "gains." + joint.joint + "." + name, value,
                       [](const Status&) {});
  }
}

RelayRecord record_relay(MachineRun& machine, const TunedJoint& tuned, double amplitude) {
  const int joint = machine.model().find_joint(tuned.joint);
  machine.run(kSettling);
  const double middle = machine.position(joint);
  const double bias = tuned.interface == "effort" ? machine.effort(joint) : 0;
  const std::unique_ptr<Edge> edge = machine.twin().bus().attach(kRelayClient);
  set_gains(*edge, tuned,
            {{"u_clamp_max", bias + amplitude},
             {"u_clamp_min", bias - amplitude},
             {"i", 0.0},
             {"d", 0.0},
             {"p", kHuge}});
  RelayRecord out;
  const double begin = to_seconds(machine.twin().now());
  const double farthest = tuned.slides ? kFarthestSlide : kFarthest;
  const auto sample = [&] {
    out.time.push_back(to_seconds(machine.twin().now()) - begin);
    out.position.push_back(machine.position(joint));
    out.escaped = out.escaped || std::abs(out.position.back() - middle) > farthest;
  };
  while (!out.escaped && (out.time.empty() || out.time.back() < kMaxRecord)) {
    if (!machine.run(kPart, sample)) out.escaped = true;
  }
  return out;
}

}  // namespace

RelayCheck check_by_relay(const TuningTwin& twin, const Suite& suite, const std::vector<TunedJoint>& joints,
                          std::size_t index, const TuningTwin::Gains& gains,
                          const std::vector<StepPlace>& places) {
  const TunedJoint& tuned = joints[index];
  RelayCheck out;
  const Subject subject = twin.variant(gains, {});
  const CheckContext context{subject, suite};
  const double limit = tuned.interface == "effort" ? tuned.plant.effort : tuned.plant.speed;
  const double share = tuned.interface == "effort" ? kEffortShare : kSpeedShare;
  const double amplitude = std::isfinite(limit) ? share * limit : 1.0;
  MachineRun machine(context, {});
  const RelayRecord record = record_relay(machine, tuned, amplitude);
  const auto figures = relay_figures(record.time, record.position,
                                     {amplitude, 0, record.time.empty() ? 0 : record.time.back() / 2});
  JointPlant plant = tuned.plant;
  plant.delay = tuned.period / 2;  // of a command that is held for a period
  const int joint = subject.model->find_joint(tuned.joint);
  const auto model = ultimate_point(plant, inertia_at(*subject.model, start_configuration(subject), joint));
  if (record.escaped) {
    out.refusal =
        "the joint moves away from the relay: without enough damping no proportional gain is stable";
    return out;
  }
  if (!figures || figures->period_spread > kMaxSpread) {
    out.refusal = "no steady oscillation: friction or a limit holds the joint";
    return out;
  }
  out.relay = {figures->ultimate_gain, figures->ultimate_period};
  out.model = model.value_or(UltimatePoint{});
  std::vector<StepPlace> start;
  for (const StepPlace& place : places)
    if (place.joint == tuned.joint && place.pose == "start pose") start.push_back(place);
  for (const TuningRule rule : kTuningRules) {
    RuleTrial trial;
    trial.rule = rule;
    const RuleGains by_rule = gains_by_rule(rule, out.relay.gain, out.relay.period).value_or(RuleGains{});
    trial.gains = {by_rule.p, by_rule.i, by_rule.d};
    TuningTwin::Gains changed = gains;
    changed[index] = trial.gains;
    trial.step = worst_step(twin.run(changed, start, {}, false), tuned.joint, suite);
    out.rules.push_back(trial);
  }
  return out;
}

}  // namespace doppel
