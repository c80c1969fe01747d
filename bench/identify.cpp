// Fits of drawn servos: shares within tolerance, coverage of the 95 % intervals, and warnings where the
// fitted model lacks an effect of the servo.   bench_identify [SERVOS] [FIRST_SEED]
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>

#include "doppel/review/identification/servo_fit.h"
#include "doppel/review/identification/test/drawn_servo.h"

namespace {

using namespace doppel;
using Quantity = ServoQuantity;

constexpr std::array kJudged{Quantity::delay,    Quantity::velocity, Quantity::stiffness, Quantity::damping,
                             Quantity::armature, Quantity::friction, Quantity::viscous};

struct Share {
  int good = 0, all = 0;
  void count(bool is_good) {
    good += is_good ? 1 : 0;
    ++all;
  }
  [[nodiscard]] std::string text() const {
    return fmt::format("{:.1f} % ({} of {})", 100.0 * good / std::max(all, 1), good, all);
  }
};

bool is_within(Quantity quantity, double value, double truth) {
  if (quantity == Quantity::delay) return std::abs(value - truth) <= 0.003;
  const bool tight = quantity == Quantity::stiffness || quantity == Quantity::velocity;
  return std::abs(value / truth - 1) <= (tight ? 0.05 : 0.1);
}

struct Totals {
  std::array<Share, kJudged.size()> within, covered;
  Share servos, quiet, warned, near;
  double seconds = 0, longest = 0;
};

ServoFit timed_fit(const DrawnServo& servo, FrictionRung last, Totals& totals) {
  const auto begin = std::chrono::steady_clock::now();
  FitOptions options;
  options.start = servo.start;
  options.last = last;
  ServoFit out = fit_servo(recording_of(servo), options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  totals.seconds += seconds;
  totals.longest = std::max(totals.longest, seconds);
  return out;
}

void run_exact(std::uint64_t seed, Totals& totals) {
  const DrawnServo servo = draw_servo(seed, FrictionRung::coulomb);
  const ServoFit fit = timed_fit(servo, FrictionRung::coulomb, totals);
  bool all = true;
  for (std::size_t i = 0; i < kJudged.size(); ++i) {
    const double truth = servo.values[static_cast<std::size_t>(kJudged[i])];
    const FittedValue& value = fit[kJudged[i]];
    const bool good = is_within(kJudged[i], value.value, truth);
    totals.within[i].count(good);
    totals.covered[i].count(value.low <= truth && truth <= value.high);
    all = all && (good || kJudged[i] == Quantity::viscous);
  }
  totals.servos.count(all);
  totals.quiet.count(fit.is_white);
}

}  // namespace

int main(int argc, char** argv) {
  const int servos = argc > 1 ? std::atoi(argv[1]) : 200;
  const int first = argc > 2 ? std::atoi(argv[2]) : 1;
  Totals totals;
  for (int i = 0; i < servos; ++i) run_exact(static_cast<std::uint64_t>(first + i), totals);
  fmt::print("M1 fitted to M1: {} servos, all six judged values within tolerance: {}\n", servos,
             totals.servos.text());
  for (std::size_t i = 0; i < kJudged.size(); ++i) {
    fmt::print("  {:10} within {:24} interval contains it {}\n", name_of(kJudged[i]), totals.within[i].text(),
               totals.covered[i].text());
  }
  fmt::print("  no warning: {}\n  {:.1f} s per fit, longest {:.1f} s\n", totals.quiet.text(),
             totals.seconds / std::max(servos, 1), totals.longest);
  Totals wrong;
  for (int i = 0; i < servos; ++i) {
    const auto seed = static_cast<std::uint64_t>(first + i);
    const FrictionRung truth = i % 2 == 0 ? FrictionRung::load : FrictionRung::stribeck;
    const ServoFit fit = timed_fit(draw_servo(seed, truth), FrictionRung::coulomb, wrong);
    wrong.warned.count(!fit.is_white);
    wrong.near.count(fit.held_out_rms <= 3 * fit.tick);
  }
  fmt::print("M1 fitted to M2 and M3: warned {}; held-out rms <= 3 ticks: {}\n", wrong.warned.text(),
             wrong.near.text());
}
