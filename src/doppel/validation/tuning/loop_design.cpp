#include "doppel/validation/tuning/loop_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace doppel {
namespace {

using Complex = std::complex<double>;

constexpr double kMinBandwidth = 0.5, kMaxBandwidth = 2000;  // rad/s
constexpr double kMinClamp = 1e-6;  // of the effort of a step: less needs no integral
constexpr int kBandwidths = 240;    // at equal ratios

// Four significant digits: what is verified is what is written.
double rounded(double value) {
  return std::strtod(fmt::format("{:.4g}", value).c_str(), nullptr);
}

// The drive of a velocity command is a PI controller of the velocity.
Complex servo_response(const JointPlant& plant, double inertia, Complex s) {
  if (!(plant.servo_stiffness > 0)) return 1.0;
  const Complex drive = plant.servo_damping * s + plant.servo_stiffness;
  return drive / (inertia * s * s + plant.damping * s + drive);
}

bool has_margins(const LoopDesign& design) {
  for (const LoopMargins* margins : {&design.at_least, &design.at_most}) {
    const bool phase = margins->phase_margin && *margins->phase_margin >= kPhaseMargin;
    const bool gain = !margins->gain_margin || *margins->gain_margin >= kGainMargin;
    const bool low = !margins->lowest_gain || *margins->lowest_gain <= 1 / kGainMargin;
    if (!margins->stable || !phase || !gain || !low) return false;
  }
  return true;
}

// The speed of a step with the whole effort, rad/s, and whether the speed limit is lower.
struct StepSpeed {
  double acceleration = 0, peak = 0;
  bool limited = false;
};
StepSpeed step_speed(const JointPlant& plant) {
  StepSpeed out;
  out.acceleration = std::max(0.0, plant.effort - plant.gravity) / plant.most_inertia;
  out.peak = std::sqrt(out.acceleration * plant.step);
  out.limited = plant.speed < out.peak;
  if (out.limited) out.peak = plant.speed;
  return out;
}

// A saturated loop brakes from speed v at the distance (D/K) v; the effort needs v^2 / (2 a). With D/K = 2/w
// the bound of w is 4 a / v, three eighths of which are left for payload and friction.
double effort_bound(const JointPlant& plant, const StepSpeed& speed) {
  if (plant.kind == LoopKind::velocity || !std::isfinite(plant.effort)) return kMaxBandwidth;
  return speed.peak > 0 ? 2.5 * speed.acceleration / speed.peak : kMinBandwidth;
}

double margin_of(const std::optional<double>& a, const std::optional<double>& b, double none) {
  return std::min(a.value_or(none), b.value_or(none));
}

}  // namespace

double LoopDesign::phase_margin() const {
  return at_least.stable && at_most.stable ? margin_of(at_least.phase_margin, at_most.phase_margin, 0) : 0.0;
}

double LoopDesign::gain_margin() const {
  return at_least.stable && at_most.stable
             ? margin_of(at_least.gain_margin, at_most.gain_margin, std::numeric_limits<double>::infinity())
             : 0.0;
}

Complex open_loop(const JointPlant& plant, const LoopGains& gains, double inertia, double w) {
  const Complex s(0, w);
  const Complex controller = gains.p + gains.i / s + gains.d * s, delay = std::exp(-plant.delay * s);
  if (plant.kind == LoopKind::velocity) return controller * servo_response(plant, inertia, s) * delay / s;
  return controller * delay / (inertia * s * s + plant.damping * s);
}

LoopGains gains_at(const JointPlant& plant, double w) {
  LoopGains out;
  if (plant.kind == LoopKind::velocity) {
    out.p = (1 + kDriftPole) * w;
    out.i = kDriftPole * w * w;
  } else {
    const double inertia = plant.most_inertia, pole = plant.integral_pole;
    out.p = inertia * w * w * (1 + 2 * pole);
    out.d = std::max(0.0, inertia * w * (2 + pole) - plant.damping);
    const double held = kClampOfGravity * plant.gravity + kClampOfFriction * plant.friction;
    if (held > kMinClamp * out.p * plant.step) {
      out.i = inertia * w * w * w * pole;
      out.clamp = rounded(held);
    }
  }
  return {rounded(out.p), rounded(out.i), rounded(out.d), out.clamp};
}

std::optional<LoopDesign> design_at(const JointPlant& plant, double bandwidth) {
  LoopDesign out;
  out.bandwidth = bandwidth;
  out.gains = gains_at(plant, bandwidth);
  // Integrators determine the phase far below the slow pole.
  const MarginSearch search{bandwidth * 1e-4, std::max(1e4, 100 * bandwidth), 100};
  const auto margins = [&](double inertia) {
    return loop_margins([&](double w) { return open_loop(plant, out.gains, inertia, w); }, search);
  };
  const auto least = margins(plant.least_inertia), most = margins(plant.most_inertia);
  if (!least || !most || !least->stable || !most->stable) return std::nullopt;
  out.at_least = *least;
  out.at_most = *most;
  return out;
}

std::optional<LoopDesign> fastest_design(const JointPlant& plant, std::optional<double> ceiling) {
  if (!(plant.least_inertia > 0) || !(plant.most_inertia > 0)) return std::nullopt;
  const StepSpeed speed = step_speed(plant);
  const double bound = effort_bound(plant, speed);
  std::optional<LoopDesign> out;
  DesignLimit limit = ceiling && *ceiling < bound ? DesignLimit::ceiling
                      : speed.limited             ? DesignLimit::speed
                                                  : DesignLimit::effort;
  const double highest = std::clamp(std::min(bound, ceiling.value_or(bound)), kMinBandwidth, kMaxBandwidth);
  for (int i = 0; i <= kBandwidths; ++i) {
    const double w = highest * std::pow(kMinBandwidth / highest, static_cast<double>(i) / kBandwidths);
    out = design_at(plant, w);
    if (!out || !has_margins(*out)) {
      limit = DesignLimit::delay;
      continue;
    }
    out->limit = limit;
    return out;
  }
  return std::nullopt;
}

std::optional<UltimatePoint> ultimate_point(const JointPlant& plant, double inertia) {
  if (plant.kind == LoopKind::effort && !(plant.damping > 0)) return std::nullopt;
  const auto margins = loop_margins(
      [&](double w) {
        return open_loop(plant, {1, 0, 0, 0}, inertia, w);
      },
      {1e-2, 1e4, 400});
  if (!margins || margins->phase_crossovers.empty()) return std::nullopt;
  const double w = margins->phase_crossovers.front();
  const double gain = 1 / std::abs(open_loop(plant, {1, 0, 0, 0}, inertia, w));
  if (!(gain > 0)) return std::nullopt;
  return UltimatePoint{gain, 2 * std::numbers::pi / w};
}

}  // namespace doppel
