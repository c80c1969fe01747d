#include "doppel/validation/metrics/step_response.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "doppel/validation/metrics/detail/samples.h"

namespace doppel {
namespace {

// A signal after its step: the first sample is that of the step, at 0 s.
struct Answer {
  std::vector<double> time, position;
};

std::optional<Answer> answer_after(std::span<const double> time, std::span<const double> position,
                                   double step_time) {
  if (!std::isfinite(step_time) || !is_sampled_signal(time, position, 1)) return std::nullopt;
  Answer out{{0.0}, {value_at(time, position, step_time)}};
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] <= step_time) continue;
    out.time.push_back(time[i] - step_time);
    out.position.push_back(position[i]);
  }
  if (out.time.size() < 3) return std::nullopt;
  return out;
}

// The instant at which the line between samples i and i + 1 has this value.
double crossing(const Answer& answer, std::size_t i, double value) {
  const double way = (value - answer.position[i]) / (answer.position[i + 1] - answer.position[i]);
  return std::lerp(answer.time[i], answer.time[i + 1], way);
}

std::optional<double> first_reach(const Answer& answer, double value, double sign) {
  for (std::size_t i = 0; i + 1 < answer.time.size(); ++i)
    if (sign * (answer.position[i + 1] - value) >= 0) return crossing(answer, i, value);
  return std::nullopt;
}

// The second divided difference at sample i.
double bend_at(const Answer& answer, std::size_t i) {
  const double* t = &answer.time[i - 1];
  const double* y = &answer.position[i - 1];
  return ((y[2] - y[1]) / (t[2] - t[1]) - (y[1] - y[0]) / (t[1] - t[0])) / (t[2] - t[0]);
}

// A corner, as that of a signal which jumps and stays, is no parabola: its neighbours are not bent.
bool is_round(const Answer& answer, std::size_t i, double sign) {
  if (i < 2 || i + 2 >= answer.time.size()) return false;
  const double bend = sign * bend_at(answer, i);
  return bend < 0 && sign * bend_at(answer, i - 1) < 0.5 * bend && sign * bend_at(answer, i + 1) < 0.5 * bend;
}

void find_peak(const Answer& answer, double sign, StepFigures& out) {
  std::size_t top = 0;
  for (std::size_t i = 1; i < answer.time.size(); ++i)
    if (sign * answer.position[i] > sign * answer.position[top]) top = i;
  out.peak = answer.position[top];
  out.peak_time = answer.time[top];
  if (!is_round(answer, top, sign)) return;
  // Newton's form of the parabola, which permits samples that are not equidistant.
  const double* t = &answer.time[top - 1];
  const double* y = &answer.position[top - 1];
  const double before = (y[1] - y[0]) / (t[1] - t[0]), bend = bend_at(answer, top);
  const double instant = 0.5 * (t[0] + t[1]) - 0.5 * before / bend;
  if (instant <= t[0] || instant >= t[2]) return;
  out.peak = y[0] + (instant - t[0]) * (before + bend * (instant - t[1]));
  out.peak_time = instant;
}

double mean_after(const Answer& answer, double begin) {
  const auto first = std::ranges::lower_bound(answer.time, begin) - answer.time.begin();
  return mean_of(std::span(answer.position).subspan(static_cast<std::size_t>(first)));
}

void find_settling(const Answer& answer, double band, double final_begin, StepFigures& out) {
  const auto outside = [&](std::size_t i) {
    return std::abs(answer.position[i] - out.final_position) > band;
  };
  std::size_t last = answer.time.size();
  while (last > 0 && !outside(last - 1)) --last;
  if (last == 0) {
    out.settled = true;
  } else if (last == answer.time.size()) {
    out.settling = answer.time.back();
  } else {
    const double side = answer.position[last - 1] > out.final_position ? band : -band;
    out.settling = crossing(answer, last - 1, out.final_position + side);
    out.settled = out.settling <= final_begin;
  }
}

}  // namespace

std::optional<StepFigures> step_figures(std::span<const double> time, std::span<const double> position,
                                        double target, const StepOptions& options) {
  const auto answer = answer_after(time, position, options.step_time);
  if (!answer || !std::isfinite(target)) return std::nullopt;
  StepFigures out;
  out.start = answer->position.front();
  out.height = target - out.start;
  if (out.height == 0) return std::nullopt;
  const double sign = out.height > 0 ? 1 : -1;
  const double final_begin = answer->time.back() - options.final_span;
  out.final_position = mean_after(*answer, final_begin);
  out.error = std::abs(target - out.final_position);
  find_peak(*answer, sign, out);
  out.overshoot = std::max(0.0, (out.peak - target) / out.height);
  const auto low = first_reach(*answer, out.start + 0.1 * out.height, sign);
  const auto high = first_reach(*answer, out.start + 0.9 * out.height, sign);
  out.reached = high.has_value();
  if (low && high) out.rise = *high - *low;
  find_settling(*answer, options.band * std::abs(out.height), final_begin, out);
  return out;
}

std::optional<double> step_coupling(std::span<const double> time, std::span<const double> position,
                                    double step_time) {
  const auto answer = answer_after(time, position, step_time);
  if (!answer) return std::nullopt;
  double largest = 0;
  for (const double value : answer->position)
    largest = std::max(largest, std::abs(value - answer->position.front()));
  return largest;
}

}  // namespace doppel
