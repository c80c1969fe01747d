#include "doppel/validation/tuning/tune.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numbers>

#include "doppel/base/core/parallel_work.h"
#include "doppel/validation/tuning/detail/joint_plants.h"
#include "doppel/validation/tuning/detail/tuning_twin.h"

namespace doppel {
namespace {

constexpr double kMarginOfUse = 0.9;  // of the limits, in the runs without perturbation
constexpr double kLowering = 0.82;    // of the bandwidth, where a step fails
constexpr int kMaxLowerings = 10;
constexpr double kMaxSaturated = 0.25;     // of the time until a step is settled
constexpr double kMinIntegralPole = 0.05;  // of the bandwidth
constexpr double kSpread = 0.2;            // of masses, friction and delay
constexpr double kMinBandwidthTried = 1;   // rad/s

std::string hertz(double w) {
  return fmt::format("{:.3g} Hz", w / (2 * std::numbers::pi));
}

std::optional<double> number_of(ParameterOverrides& overrides, const std::string& name) {
  const ParameterOverride* const found = overrides.find(name);
  if (found == nullptr) return std::nullopt;
  if (const auto* value = std::get_if<double>(&found->value)) return *value;
  if (const auto* value = std::get_if<std::int64_t>(&found->value)) return static_cast<double>(*value);
  return std::nullopt;
}

// The gains of the joint in the machine's files.
std::optional<LoopGains> written_gains(const Subject& subject, const TunedJoint& joint) {
  ParameterOverrides overrides =
      subject.robot().setup().controllers.overrides_for("/" + joint.controller, joint.controller);
  const std::string prefix = "gains." + joint.joint + ".";
  const auto p = number_of(overrides, prefix + "p"), i = number_of(overrides, prefix + "i"),
             d = number_of(overrides, prefix + "d");
  if (!p && !i && !d) return std::nullopt;
  return LoopGains{p.value_or(0), i.value_or(0), d.value_or(0),
                   number_of(overrides, prefix + "i_clamp_max").value_or(kInfinity)};
}

// The controller that commands the joint, and whether its gains close the loop.
void find_controller(MachineRun& machine, TunedJoint& joint) {
  for (const ControllerView& view : machine.twin().robot().controller_manager().controllers()) {
    if (view.state != ControllerState::active) continue;
    std::vector<std::string> interfaces;
    for (const std::string& command : view.required_commands) {
      if (command.starts_with(joint.joint + "/"))
        interfaces.push_back(command.substr(joint.joint.size() + 1));
    }
    if (interfaces.empty()) continue;
    joint.controller = view.name;
    joint.type = view.type;
    joint.interface = interfaces.front();
    joint.period = view.update_rate > 0 ? 1 / view.update_rate : 0;
    const bool closes = interfaces.size() == 1 && joint.interface != "position";
    joint.gains_act = closes && (view.type.ends_with("JointTrajectoryController") ||
                                 (view.type.ends_with("PidController") &&
                                  machine.reference_way(machine.model().find_joint(joint.joint))));
  }
}

class Tuner {
 public:
  Tuner(const Subject& subject, const Suite& suite, const TuneOptions& options)
      : subject_(subject), suite_(suite), options_(options), twin_(subject, suite_, quiet_, report_.joints) {
    quiet_ = options;
    quiet_.progress = [this](double, const std::string&) { return advance(0); };
  }

  TuneReport run() {
    const auto begin = std::chrono::steady_clock::now();
    report_.robot = subject_.name;
    report_.payload = suite_.tool.mass;
    find_joints();
    say("the models");
    make_plants();
    CheckContext context{subject_, suite_};
    context.joint = options_.joint;
    places_ = step_places(context, StepPoses::all);
    say("the present gains");
    judge_present();
    if (report_.any_gains_act()) {
      design();
      search();
      if (options_.relay) cross_check();
    }
    explain();
    report_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return std::move(report_);
  }

 private:
  // A state of the search: designs with the figures that they got.
  struct Candidate {
    std::optional<LoopDesign> design;
    WorstStep after, perturbed;
    [[nodiscard]] double use() const { return std::max(after.use / kMarginOfUse, perturbed.use); }
  };

  void say(const std::string& what) {
    what_ = what;
    static_cast<void>(advance(0));
  }

  bool advance(double part) {
    const std::lock_guard lock(mutex_);
    done_ = std::min(0.99, done_ + part);
    cancelled_ = cancelled_ || (options_.progress && !options_.progress(done_, what_));
    if (cancelled_) throw CheckCancelled{};
    return true;
  }

  void find_joints() {
    CheckContext context{subject_, suite_};
    context.joint = options_.joint;
    MachineRun machine(context, {});
    for (const int index : machine.joints()) {
      TunedJoint joint;
      joint.joint = machine.joint(index).name;
      joint.slides = machine.slides(index);
      const ServoParameters& servo =
          machine.twin().robot().machine().servos()[static_cast<std::size_t>(index)];
      joint.stiffness = servo.stiffness;
      joint.damping = servo.damping;
      joint.plant.least_inertia = joint.plant.most_inertia = servo.rotor_inertia;
      joint.plant.effort = servo.effort;
      joint.plant.speed = servo.velocity;
      find_controller(machine, joint);
      joint.old_gains = written_gains(subject_, joint);
      report_.joints.push_back(std::move(joint));
    }
  }

  void make_plants() {
    const std::vector<PlantLoad> loads = joint_loads(subject_, suite_.tool);
    for (TunedJoint& joint : report_.joints) {
      const PlantLoad& load = loads[static_cast<std::size_t>(subject_.model->find_joint(joint.joint))];
      JointPlant& plant = joint.plant;
      const StepResponseLimits& limits = suite_.step_of(joint.joint);
      const bool by_effort = joint.interface == "effort";
      plant.kind = by_effort ? LoopKind::effort : LoopKind::velocity;
      const double rotor = by_effort ? plant.most_inertia : 0;
      plant.least_inertia = load.least_inertia + rotor;
      plant.most_inertia = load.most_inertia + rotor;
      plant.damping = load.damping;
      plant.friction = load.friction;
      plant.gravity = load.gravity;
      plant.delay = joint.period + options_.transport;
      plant.step = joint.slides ? limits.slide_size : limits.size;
      if (by_effort) continue;
      plant.servo_stiffness = joint.stiffness;
      plant.servo_damping = joint.damping;
    }
  }

  // The steps of these joints, each joint in a twin of its own, so that threads do not change the results.
  [[nodiscard]] std::vector<StepTrial> steps_of(const std::vector<bool>& chosen,
                                                const TuningTwin::Gains& gains) {
    std::vector<std::vector<StepTrial>> trials(report_.joints.size());
    parallel_work(report_.joints.size(), options_.jobs, [&] {
      return [&](std::size_t i) {
        if (!chosen[i]) return;
        std::vector<StepPlace> places;
        for (const StepPlace& place : places_)
          if (place.joint == report_.joints[i].joint) places.push_back(place);
        trials[i] = twin_.run(gains, places, {});
      };
    });
    std::vector<StepTrial> out;
    for (auto& some : trials) std::ranges::move(some, std::back_inserter(out));
    return out;
  }

  void judge_present() {
    const std::vector<StepTrial> trials = steps_of(std::vector(report_.joints.size(), true), {});
    for (TunedJoint& joint : report_.joints) joint.before = worst_step(trials, joint.joint, suite_);
    for (TunedJoint& joint : report_.joints) {
      if (!joint.gains_act) joint.after = joint.before;
    }
  }

  void design() {
    for (TunedJoint& joint : report_.joints) {
      if (joint.gains_act) joint.design = fastest_design(joint.plant, options_.bandwidth);
    }
    limits_.assign(report_.joints.size(), {});
    best_.assign(report_.joints.size(), {});
    settled_.assign(report_.joints.size(), false);
    changed_.assign(report_.joints.size(), true);
  }

  [[nodiscard]] TuningTwin::Gains gains() const {
    TuningTwin::Gains out;
    for (const TunedJoint& joint : report_.joints)
      out.push_back(joint.design ? std::optional(joint.design->gains) : std::nullopt);
    return out;
  }

  // Lowers the bandwidth of the joints whose steps fail until they pass, or until lower ones are worse.
  void search() {
    for (int round = 0; round <= kMaxLowerings; ++round) {
      say(round == 0 ? "the steps with new gains" : "the steps with a lower bandwidth");
      judge_nominal();
      advance(0.03);
      if (lower(round)) continue;
      say("the runs with other masses, friction and delay");
      judge_perturbed();
      if (!lower(round)) break;
    }
    for (std::size_t i = 0; i < report_.joints.size(); ++i) {
      if (best_[i].design) report_.joints[i].design = best_[i].design;
    }
    // All of them together.
    say("the steps with the final gains");
    changed_.assign(report_.joints.size(), true);
    judge_nominal();
    judge_perturbed();
  }

  // The steps of the joints whose gains have changed.
  void judge_nominal() {
    std::vector<StepTrial> trials = steps_of(changed_, gains());
    for (std::size_t i = 0; i < report_.joints.size(); ++i) {
      TunedJoint& joint = report_.joints[i];
      if (!changed_[i]) continue;
      std::erase_if(nominal_, [&](const StepTrial& trial) { return trial.place.joint == joint.joint; });
      joint.after = worst_step(trials, joint.joint, suite_);
      joint.perturbed = {};
    }
    std::ranges::move(trials, std::back_inserter(nominal_));
    changed_.assign(report_.joints.size(), false);
  }

  // The next design to try: against an overshoot first a slower integral, else, and where the drive is
  // saturated, a lower bandwidth.
  std::optional<LoopDesign> next_design(TunedJoint& joint, const WorstStep& worst) const {
    const bool overshoots = worst.overshoot / suite_.step_of(joint.joint).overshoot >= 0.99 * worst.use &&
                            worst.saturated < kMaxSaturated;
    if (overshoots && joint.interface == "effort" && joint.plant.integral_pole > kMinIntegralPole) {
      joint.plant.integral_pole /= 2;
      auto out = fastest_design(joint.plant, joint.design->bandwidth);
      if (out && out->limit == DesignLimit::ceiling) out->limit = joint.design->limit;
      return out;
    }
    const double bandwidth = joint.design->bandwidth * kLowering;
    return bandwidth < kMinBandwidthTried ? std::nullopt : fastest_design(joint.plant, bandwidth);
  }

  // True if a joint got another design.
  bool lower(int round) {
    bool out = false;
    for (std::size_t i = 0; i < report_.joints.size(); ++i) {
      TunedJoint& joint = report_.joints[i];
      if (!joint.design) continue;
      const Candidate now{joint.design, joint.after, joint.perturbed};
      const bool fails = now.use() > 1;
      const bool judged = joint.perturbed.judged || fails;
      if (judged && (!best_[i].design || now.use() < best_[i].use())) best_[i] = now;
      if (!fails || settled_[i] || round == kMaxLowerings) continue;
      const bool gets_worse = best_[i].design && now.use() > 1.5 * best_[i].use();
      const WorstStep worst = joint.after.use > kMarginOfUse ? joint.after : joint.perturbed;
      const auto next = gets_worse ? std::nullopt : next_design(joint, worst);
      if (!next) {
        settled_[i] = true;
        continue;
      }
      limits_[i] = {joint.design->bandwidth, fmt::format("a step at {} fails or has too little margin ({}{})",
                                                         hertz(joint.design->bandwidth), worst.place,
                                                         worst.message.empty() ? "" : ": " + worst.message)};
      joint.design = next;
      changed_[i] = out = true;
    }
    return out;
  }

  // The places at which each joint's steps use the most of their limits, without or with payload.
  [[nodiscard]] std::vector<StepPlace> worst_places(bool payload) const {
    std::vector<StepPlace> out;
    for (const TunedJoint& joint : report_.joints) {
      if (!joint.design) continue;
      const StepTrial* worst = nullptr;
      double most = -1;
      for (const StepTrial& trial : nominal_) {
        if (trial.place.joint != joint.joint || trial.height == 0) continue;
        const WorstStep one = worst_step({trial}, joint.joint, suite_);
        if (one.use <= most) continue;
        most = one.use;
        worst = &trial;
      }
      if (worst != nullptr && worst->payload == payload) out.push_back(worst->place);
    }
    return out;
  }

  void judge_perturbed() {
    const std::array<double, 3> factors = {1 - kSpread, 1, 1 + kSpread};
    std::vector<Perturbation> all;
    for (const double mass : factors)
      for (const double friction : factors)
        for (const double delay : factors) all.push_back({mass, friction, delay});
    const std::array<std::vector<StepPlace>, 2> places = {worst_places(false), worst_places(true)};
    std::vector<std::vector<StepTrial>> trials(all.size());
    const TuningTwin::Gains now = gains();
    parallel_work(all.size(), options_.jobs, [&] {
      return [&](std::size_t i) {
        for (const bool payload : {false, true}) {
          if (places[payload ? 1 : 0].empty()) continue;
          auto some = twin_.run(now, places[payload ? 1 : 0], all[i], payload);
          std::ranges::move(some, std::back_inserter(trials[i]));
        }
        advance(0.01);
      };
    });
    report_.runs = static_cast<int>(all.size());
    for (TunedJoint& joint : report_.joints) {
      if (!joint.design) continue;
      joint.perturbed = {};
      for (std::size_t i = 0; i < all.size(); ++i) take_worse(trials[i], all[i], joint);
    }
  }

  void take_worse(const std::vector<StepTrial>& trials, const Perturbation& how, TunedJoint& joint) const {
    WorstStep one = worst_step(trials, joint.joint, suite_);
    if (!one.judged) return;
    one.place +=
        fmt::format(", mass x {:g}, friction x {:g}, delay x {:g}", how.mass, how.friction, how.delay);
    WorstStep& out = joint.perturbed;
    const bool passed = (out.passed || !out.judged) && one.passed;
    const WorstStep both = one.use > out.use ? one : out;
    out = {true,
           passed,
           std::max(out.overshoot, one.overshoot),
           std::max(out.settling, one.settling),
           std::max(out.error, one.error),
           std::max(out.peak_effort, one.peak_effort),
           both.saturated,
           both.use,
           both.place,
           both.message};
  }

  void cross_check() {
    for (std::size_t i = 0; i < report_.joints.size(); ++i) {
      if (!report_.joints[i].design) continue;
      say("relay of " + report_.joints[i].joint);
      report_.joints[i].relay = check_by_relay(twin_, suite_, report_.joints, i, gains(), places_);
    }
  }

  void explain() {
    for (std::size_t i = 0; i < report_.joints.size(); ++i) {
      TunedJoint& joint = report_.joints[i];
      if (!joint.gains_act) continue;
      if (!joint.design) {
        joint.why_not_faster = fmt::format(
            "no bandwidth has a phase margin of 45 deg and a gain margin of 6 dB with a delay of {:.3g} ms "
            "and "
            "inertias from {:.3g} to {:.3g}",
            1e3 * joint.plant.delay, joint.plant.least_inertia, joint.plant.most_inertia);
        continue;
      }
      const auto& [tried, failure] = limits_[i];
      const bool was_lowered = tried > 1.01 * joint.design->bandwidth;
      joint.why_not_faster = was_lowered ? failure : reason_of(joint);
    }
  }

  [[nodiscard]] std::string reason_of(const TunedJoint& joint) const {
    const LoopDesign& design = *joint.design;
    const char* const unit = joint.slides ? "N" : "N m";
    switch (design.limit) {
      case DesignLimit::ceiling:
        return "it is the one of --bandwidth";
      case DesignLimit::effort:
        return fmt::format("effort: with {:.3g} {} it could not brake a faster step without overshoot",
                           joint.plant.effort, unit);
      case DesignLimit::speed:
        return fmt::format("speed: at the limit of {:.3g} {} the effort of {:.3g} {} brakes no later",
                           joint.plant.speed, joint.slides ? "m/s" : "rad/s", joint.plant.effort, unit);
      case DesignLimit::delay:
        break;
    }
    return options_.transport > joint.period
               ? fmt::format("delay: {:.3g} ms of transport leave no more phase", 1e3 * options_.transport)
               : fmt::format(
                     "rate: the controller's period of {:.3g} ms leaves no more phase; raise update_rate",
                     1e3 * joint.period);
  }

  const Subject& subject_;
  const Suite suite_;
  const TuneOptions& options_;
  TuneOptions quiet_;
  TuneReport report_;
  TuningTwin twin_;
  std::vector<StepPlace> places_;
  std::vector<StepTrial> nominal_;
  std::vector<std::pair<double, std::string>> limits_;  // [joints] the last bandwidth that failed, and how
  std::vector<Candidate> best_;                         // [joints]
  std::vector<bool> settled_;                           // [joints] no other design is tried
  std::vector<bool> changed_;                           // [joints] since their steps were judged
  std::mutex mutex_;
  std::string what_;
  double done_ = 0;
  bool cancelled_ = false;
};

}  // namespace

bool TunedJoint::passed() const {
  if (!after.judged) return !gains_act;
  return after.passed && (!gains_act || (design && perturbed.passed));
}

bool TuneReport::passed() const {
  return std::ranges::all_of(joints, &TunedJoint::passed);
}

bool TuneReport::any_gains_act() const {
  return std::ranges::any_of(joints, &TunedJoint::gains_act);
}

TuneReport tune(const Subject& subject, const Suite& suite, const TuneOptions& options) {
  return Tuner(subject, suite, options).run();
}

}  // namespace doppel
