#include "doppel/validation/extras/response_extra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/math/units.h"
#include "doppel/validation/extras/detail/extra_arm.h"
#include "doppel/validation/extras/detail/joint_motion.h"
#include "doppel/validation/extras/detail/servo_response.h"
#include "doppel/validation/metrics/frequency_response.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kAmplitude = 0.05, kSlideAmplitude = 0.005;  // rad, m
constexpr double kSpeedShare = 0.5;                           // of the speed limit that a sweep may take
constexpr double kTopFrequency = 20;                          // Hz
constexpr double kTicksPerCycle = 4;                          // of the controller at the highest frequency
constexpr double kRestAfter = 1.5;                            // s
constexpr double kSampleRate = 250;                           // Hz, about
constexpr double kPointStep = 0.002;                          // s between points of the command
constexpr double kSaturated = 0.999;                          // of the effort limit
constexpr double kModelGain = 1, kModelPhase = 5;             // dB, deg: larger differences are named

double decibels(double magnitude) {
  return 20 * std::log10(magnitude);
}

struct SweepRecord {
  std::vector<double> input, output;
  double rate = 0;       // Hz
  double saturated = 0;  // share of the record at the effort limit
};

class ResponseJudge {
 public:
  ResponseJudge(const CheckContext& context, CheckResult& out)
      : context_(context), machine_(context, {}), start_(machine_.save()), out_(out) {}

  void run() {
    const std::vector<int>& joints = machine_.joints();
    for (std::size_t i = 0; i < joints.size(); ++i) {
      judge(joints[i]);
      context_.report(static_cast<double>(i + 1) / static_cast<double>(joints.size()));
    }
  }

  [[nodiscard]] double lowest() const { return lowest_; }

 private:
  // Within the speed limit and, with some room, within the range.
  SineSweep sweep_of(int joint, double period) {
    const ModelJoint& about = machine_.joint(joint);
    SineSweep out;
    out.amplitude = machine_.slides(joint) ? kSlideAmplitude : kAmplitude;
    out.low = context_.amount(5, 2, 1) / 10.0;
    out.duration = context_.amount(6, 15, 30);
    out.high = std::min(kTopFrequency, 1 / (kTicksPerCycle * period));
    if (out.high < kTopFrequency)
      out_.notes.push_back(
          fmt::format("{}: up to {:.3g} Hz, which its controller's period of {:.3g} s permits", about.name,
                      out.high, period));
    const double asked_for = out.amplitude;
    const double range = about.upper - about.lower;
    if (std::isfinite(range)) out.amplitude = std::min(out.amplitude, range / 4);
    if (std::isfinite(about.velocity) && out.max_speed() > kSpeedShare * about.velocity)
      out.amplitude *= kSpeedShare * about.velocity / out.max_speed();
    if (out.amplitude < asked_for)
      out_.notes.push_back(
          fmt::format("{}: an amplitude of {} instead of {}, so that {:.3g} Hz stay below {:.0f} % of its "
                      "speed limit and inside its range",
                      about.name, position_text(out.amplitude, machine_.slides(joint)),
                      position_text(asked_for, machine_.slides(joint)), out.high, kPercent * kSpeedShare));
    return out;
  }

  // The start pose with the joint far enough inside its limits.
  Eigen::VectorXd pose_of(int joint, double amplitude) const {
    Eigen::VectorXd q = start_configuration(context_.subject);
    const Model& model = *context_.subject.model;
    const ModelJoint& about =
        model.joints[static_cast<std::size_t>(model.find_joint(machine_.joint(joint).name))];
    const double room = 1.5 * amplitude;
    q[about.q] = std::clamp(q[about.q], std::min(about.lower + room, 0.5 * (about.lower + about.upper)),
                            std::max(about.upper - room, 0.5 * (about.lower + about.upper)));
    model.apply_mimics(q);
    return q;
  }

  void judge(int joint) {
    const std::string& name = machine_.joint(joint).name;
    JointMotion motion(machine_, {name});
    if (!motion.missing().empty()) {
      out_.notes.push_back(name + " has no position command on a topic");
      return;
    }
    machine_.restore(*start_);
    const SineSweep sweep = sweep_of(joint, motion.period());
    const Eigen::VectorXd q = pose_of(joint, sweep.amplitude);
    const bool is_fixed = context_.subject.robot().base() == BaseKind::fixed;
    if (!sweep.valid() || (is_fixed && !machine_.place(posed_joints(*context_.subject.model, q)))) {
      out_.notes.push_back(name + ": its pose cannot be taken");
      return;
    }
    machine_.run(0.5);
    const auto record = record_sweep(joint, motion, sweep);
    if (!record) return out_.notes.push_back(name + ": the physics diverges during the sweep");
    ResponseOptions options;
    options.low = sweep.low;
    options.high = sweep.high;
    const auto response = frequency_response(record->input, record->output, record->rate, options);
    if (!response) return out_.notes.push_back(name + ": the record gives no response");
    add(joint, *response, model_of(name, q, *response, motion.period()), record->saturated);
  }

  std::optional<SweepRecord> record_sweep(int joint, JointMotion& motion, const SineSweep& sweep) {
    const double step = to_seconds(machine_.twin().step_size());
    const int skip = std::max(1, static_cast<int>(std::lround(1 / (kSampleRate * step))));
    SweepRecord out;
    out.rate = 1 / (skip * step);
    const double centre = machine_.twin().robot().instance().drive_reference(joint);
    const auto course = [&](double time) {
      return Eigen::VectorXd::Constant(1, centre + sweep.position_at(time)).eval();
    };
    int count = 0;
    double saturated = 0;
    const bool ran = motion.run(course, sweep.end(), kPointStep, kRestAfter, [&](double time) {
      if (count++ % skip != 0) return;
      out.input.push_back(centre + sweep.position_at(time));
      out.output.push_back(machine_.position(joint));
      saturated += std::abs(machine_.effort(joint)) > kSaturated * machine_.joint(joint).effort ? 1 : 0;
    });
    out.saturated = out.output.empty() ? 0 : saturated / static_cast<double>(out.output.size());
    return ran ? std::optional(out) : std::nullopt;
  }

  // The same points by the servo model; none for a joint without a servo.
  std::vector<FrequencyPoint> model_of(const std::string& name, const Eigen::VectorXd& q,
                                       const std::vector<FrequencyPoint>& response, double period) const {
    const ServoResponse model(context_.subject, q);
    std::vector<FrequencyPoint> out;
    if (!model.has(name)) return out;
    for (const FrequencyPoint& point : response) {
      const std::complex<double> value = model.at_frequency(name, point.frequency, period);
      FrequencyPoint next{point.frequency, std::abs(value), std::arg(value), 1};
      if (!out.empty())
        next.phase = out.back().phase + std::remainder(next.phase - out.back().phase, 2 * std::numbers::pi);
      out.push_back(next);
    }
    return out;
  }

  static PlotCurve curve_of(const std::string& label, const std::vector<FrequencyPoint>& points, bool phase) {
    PlotCurve out{label, {}, {}};
    for (const FrequencyPoint& point : points) {
      out.times.push_back(point.frequency);
      out.values.push_back(phase ? point.phase / kDegree : decibels(point.magnitude));
    }
    return out;
  }

  static std::string bandwidth_text(const Bandwidth& bandwidth, const FrequencyPoint& top) {
    const std::string peak = fmt::format("peak {:+.1f} dB at {:.1f} Hz", decibels(bandwidth.peak_magnitude),
                                         bandwidth.peak_frequency);
    if (!bandwidth.frequency)
      return fmt::format("{:.1f} dB and {:.0f} deg at {:.3g} Hz, above which its bandwidth is; {}",
                         decibels(top.magnitude), top.phase / kDegree, top.frequency, peak);
    return fmt::format("-3 dB at {:.2f} Hz, phase there {:.0f} deg, {}", *bandwidth.frequency,
                       bandwidth.phase / kDegree, peak);
  }

  void add(int joint, const std::vector<FrequencyPoint>& response, const std::vector<FrequencyPoint>& model,
           double saturated) {
    const std::string& name = machine_.joint(joint).name;
    const auto bandwidth = bandwidth_of(response);
    if (!bandwidth) return out_.notes.push_back(name + ": the response is too noisy for a bandwidth");
    CheckItem item;
    item.subject = name;
    item.message = bandwidth_text(*bandwidth, response.back());
    if (bandwidth->frequency) {
      out_.metrics.push_back(
          {"bandwidth", name, *bandwidth->frequency, "Hz", std::nullopt, Metric::Better::higher});
      out_.metrics.push_back({"phase at the bandwidth", name, bandwidth->phase / kDegree, "deg", std::nullopt,
                              Metric::Better::higher});
      lowest_ = std::min(lowest_, *bandwidth->frequency);
    }
    out_.metrics.push_back({"peak", name, decibels(bandwidth->peak_magnitude), "dB"});
    if (!model.empty()) compare(item, response, model, bandwidth->frequency.value_or(kInfinity));
    if (saturated > 0)
      item.message +=
          fmt::format("; its effort limit is reached during {:.1f} % of the sweep", kPercent * saturated);
    for (const bool phase : {false, true}) {
      PlotPanel panel;
      panel.title = fmt::format("{}: {} over the frequency", name, phase ? "phase" : "magnitude");
      panel.unit = phase ? "deg" : "dB";
      panel.x_axis = "frequency, Hz";
      panel.curves.push_back(curve_of("measured", response, phase));
      if (!model.empty()) panel.curves.push_back(curve_of("servo model", model, phase));
      item.curves.push_back(std::move(panel));
    }
    out_.add(std::move(item));
  }

  // The largest differences up to the bandwidth.
  void compare(CheckItem& item, const std::vector<FrequencyPoint>& response,
               const std::vector<FrequencyPoint>& model, double end) {
    double gain = 0, phase = 0;
    for (std::size_t i = 0; i < response.size() && response[i].frequency <= end; ++i) {
      gain = std::max(gain, std::abs(decibels(response[i].magnitude) - decibels(model[i].magnitude)));
      phase = std::max(phase, std::abs(response[i].phase - model[i].phase) / kDegree);
    }
    out_.metrics.push_back({"difference from the servo model", item.subject, gain, "dB"});
    out_.metrics.push_back({"phase difference from the servo model", item.subject, phase, "deg"});
    item.message += fmt::format("; the servo model differs by up to {:.2f} dB, {:.1f} deg", gain, phase);
    if (gain > kModelGain || phase > kModelPhase)
      item.message += ", by friction, the effort limit or gains of the controller";
  }

  const CheckContext& context_;
  MachineRun machine_;
  std::shared_ptr<const SavedState> start_;
  CheckResult& out_;
  double lowest_ = kInfinity;  // Hz
};

}  // namespace

CheckResult check_frequency_response(const CheckContext& context) {
  CheckResult out = begin_result("X2");
  ResponseJudge judge(context, out);
  judge.run();
  if (out.items.empty())
    return not_applicable("X2",
                          out.notes.empty() ? "no joint has a drive" : "no joint has a position command");
  out.summary = std::isfinite(judge.lowest()) ? fmt::format("bandwidth at least {:.2f} Hz", judge.lowest())
                                              : "every bandwidth is above the sweep";
  return out;
}

}  // namespace doppel
