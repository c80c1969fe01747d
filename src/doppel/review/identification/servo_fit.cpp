#include "doppel/review/identification/servo_fit.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/identification/detail/fit_statistics.h"
#include "doppel/review/identification/detail/servo_simulation.h"

namespace doppel {
namespace {

using identification_detail::ServoSimulation;
using Quantity = ServoQuantity;

constexpr double kSpread = 3.0;       // of the prior in logarithms: a factor of 20 is one sigma
constexpr double kIdentified = 0.35;  // half a 95 % interval in logarithms that counts as identified
constexpr double kHighCorrelation = 0.95;
constexpr double kSettling = 0.5;  // s, whose residuals do not count
constexpr double kBlock = 1.0;     // s, of training and held-out data in turn
constexpr int kLags = 10;
constexpr double kNegligible = 2e-4;     // rad or m, of a residual
constexpr double kMaxStructure = 0.006;  // share of the residuals' variance
constexpr double kRareLimit = 0.002;     // share of the time at a limit
constexpr double kNormal = 1.96;         // of a 95 % interval
// Half the interval over sigma. The estimate of the long-run covariance is biased low: with kNormal,
// intervals of drawn servos contained the truth in 85 % of the cases (bench/identify.cpp).
constexpr double kCoverage = 1.4 * kNormal;
constexpr double kMaxYielding = 0.1;   // of the whole inertia, up to which an effort limit is identified
constexpr double kLowerEffort = 0.75;  // of the largest effort, a start below a limit that does not act

std::size_t index_of(Quantity quantity) {
  return static_cast<std::size_t>(quantity);
}

struct Bounds {
  double low, high;
};
// In the order of ServoQuantity; wide enough for every servo of an arm.
constexpr std::array<Bounds, kServoQuantities> kBounds{{{2e-4, 0.2},
                                                        {0.02, 200},
                                                        {1e-3, 1e4},
                                                        {1e-2, 1e6},
                                                        {1e-5, 1e5},
                                                        {1e-7, 1e2},
                                                        {1e-7, 1e4},
                                                        {1e-6, 1e3},
                                                        {1e-6, 1e3},
                                                        {1e-4, 10},
                                                        {1e-5, 0.9},
                                                        {1e-6, 0.3}}};

std::vector<Quantity> quantities_of(FrictionRung rung) {
  std::vector<Quantity> out{Quantity::delay,     Quantity::velocity, Quantity::effort,
                            Quantity::stiffness, Quantity::damping,  Quantity::armature};
  if (rung >= FrictionRung::coulomb) out.insert(out.end(), {Quantity::viscous, Quantity::friction});
  if (rung >= FrictionRung::stribeck) out.insert(out.end(), {Quantity::breakaway, Quantity::stribeck});
  if (rung >= FrictionRung::load) out.push_back(Quantity::load_factor);
  if (rung >= FrictionRung::backlash) out.push_back(Quantity::backlash);
  return out;
}

ServoValues without_upper_rungs(ServoValues values, FrictionRung rung) {
  const std::vector<Quantity> used = quantities_of(rung);
  for (std::size_t i = index_of(Quantity::viscous); i < kServoQuantities; ++i) {
    if (std::ranges::find(used, static_cast<Quantity>(i)) == used.end()) values[i] = 0;
  }
  return values;
}

struct Evaluation {
  ServoValues values{};
  double cost = 0;  // weighted sum of the squared residuals, and of the prior's
};

class Fitter {
 public:
  Fitter(const JointRecord& record, const FitOptions& options);
  ServoFit run();

 private:
  using Mask = std::vector<char>;
  double cost_of(const ServoValues& values, const Mask& mask);
  double rms_of(const Mask& mask) const;
  void jacobian(const ServoValues& values, const std::vector<Quantity>& free);
  ServoValues screened();
  ServoValues minimised(ServoValues values, const std::vector<Quantity>& free, const Mask& mask);
  ServoValues from_below(const ServoValues& values, FrictionRung rung) const;
  void climb(ServoFit& out, ServoValues& best);
  ServoValues settled(const ServoValues& values, const std::vector<Quantity>& free);
  void widen(ServoFit& out) const;
  void judge(ServoFit& out, const ServoValues& values);
  void judge_residuals(ServoFit& out) const;
  [[nodiscard]] bool is_one_number(const ServoFit& fit, Quantity quantity) const;
  [[nodiscard]] double scale_information(const ServoValues& values, double inertia);
  void name_problems(ServoFit& out, const std::vector<Quantity>& free, const ServoValues& values,
                     const Eigen::MatrixXd& covariance, double noise);

  const JointRecord& record_;
  const FitOptions& options_;
  ServoSimulation simulation_;
  std::vector<double> predicted_, shifted_;
  Mask training_, held_out_, all_, moving_;
  Eigen::MatrixXd jacobian_;   // [samples, free], in logarithms
  Eigen::VectorXd residuals_;  // measured - predicted
  // Weights: samples at one and the same rounded position have one common error.
  Eigen::VectorXd independence_;
  double tick_ = 0, floor_ = 0, prior_ = 0;  // rad; the prior's weight
  std::vector<Evaluation> minima_;
  int simulations_ = 0;
};

Fitter::Fitter(const JointRecord& record, const FitOptions& options)
    : record_(record), options_(options), simulation_(record) {
  const std::size_t n = record.time.size();
  predicted_.resize(n);
  shifted_.resize(n);
  residuals_.resize(static_cast<Eigen::Index>(n));
  training_.assign(n, 0);
  held_out_ = all_ = moving_ = training_;
  independence_.setOnes(static_cast<Eigen::Index>(n));
  for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
    while (end < n && record.position[end] == record.position[begin]) ++end;
    for (std::size_t i = begin; i < end; ++i)
      independence_[static_cast<Eigen::Index>(i)] = 1.0 / static_cast<double>(end - begin);
  }
  tick_ = record.tick > 0 ? record.tick : estimate_tick(record.position);
  floor_ = std::max(tick_ / std::sqrt(12.0), 1e-6);
  prior_ = floor_ * floor_ / (kSpread * kSpread);
  for (std::size_t i = 0; i < n; ++i) {
    const double since = record.time[i] - record.time.front();
    if (since < kSettling) continue;
    all_[i] = 1;
    // A fall under wrong values is wrong as a whole, and would lead the ladder astray.
    if (identification_detail::is_in_release(record, record.time[i])) continue;
    // 7 of 10 blocks train; 3, 6 and 9 are held out.
    const auto block = static_cast<std::size_t>(since / kBlock) % 10;
    (block % 3 == 2 ? held_out_ : training_)[i] = 1;
    moving_[i] = i + 3 < n && i > 2 && std::abs(record.position[i + 3] - record.position[i - 3]) > 6 * tick_;
  }
}

double Fitter::cost_of(const ServoValues& values, const Mask& mask) {
  simulation_.run(values, predicted_);
  ++simulations_;
  if (options_.progress && !options_.progress(simulations_)) throw FitCancelled{};
  double sum = 0;
  for (std::size_t i = 0; i < predicted_.size(); ++i) {
    const double e = record_.position[i] - predicted_[i];
    residuals_[static_cast<Eigen::Index>(i)] = e;
    if (mask[i] != 0) sum += independence_[static_cast<Eigen::Index>(i)] * e * e;
  }
  for (std::size_t i = 0; i < kServoQuantities; ++i) {
    if (!(values[i] > 0) || !(options_.start[i] > 0)) continue;
    const double away = std::log(values[i] / options_.start[i]);
    sum += prior_ * away * away;
  }
  return std::isfinite(sum) ? sum : 1e300;
}

double Fitter::rms_of(const Mask& mask) const {
  double sum = 0, n = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    sum += residuals_[static_cast<Eigen::Index>(i)] * residuals_[static_cast<Eigen::Index>(i)];
    n += 1;
  }
  return std::sqrt(sum / std::max(n, 1.0));
}

// Central differences; predicted_ and residuals_ are those of `values` already.
void Fitter::jacobian(const ServoValues& values, const std::vector<Quantity>& free) {
  constexpr double kStep = 3e-2;
  jacobian_.resize(residuals_.size(), static_cast<Eigen::Index>(free.size()));
  for (std::size_t j = 0; j < free.size(); ++j) {
    ServoValues aside = values;
    double& value = aside[index_of(free[j])];
    const double middle = value;
    value = middle * std::exp(kStep);
    simulation_.run(aside, shifted_);
    auto column = jacobian_.col(static_cast<Eigen::Index>(j));
    column = Eigen::Map<const Eigen::VectorXd>(shifted_.data(), residuals_.size());
    value = middle * std::exp(-kStep);
    simulation_.run(aside, shifted_);
    column -= Eigen::Map<const Eigen::VectorXd>(shifted_.data(), residuals_.size());
    column /= 2 * kStep;
    simulations_ += 2;
  }
}

// The best of a grid about the description's values: far from the minimum the cost has others.
ServoValues Fitter::screened() {
  ServoValues start = options_.start;
  for (std::size_t i = 0; i < kServoQuantities; ++i)
    start[i] = std::clamp(start[i], kBounds[i].low, kBounds[i].high);
  start = without_upper_rungs(start, FrictionRung::coulomb);
  const std::vector<double>& t = record_.time;
  double fastest = 0;
  for (std::size_t i = 0; i + 8 < t.size(); ++i) {
    fastest = std::max(fastest, std::abs(record_.position[i + 8] - record_.position[i]) / (t[i + 8] - t[i]));
  }
  double best_cost = 1e300;
  ServoValues best = start;
  const double velocities[] = {start[index_of(Quantity::velocity)], std::max(fastest, 0.02)};
  for (const double velocity : velocities) {
    for (const double stiffness : {0.25, 0.5, 1.0, 2.0, 4.0}) {
      for (const double damping : {0.3, 1.0, 3.0}) {
        for (const double friction : {0.3, 1.0, 3.0}) {
          ServoValues one = start;
          one[index_of(Quantity::velocity)] = velocity;
          one[index_of(Quantity::stiffness)] *= stiffness;
          one[index_of(Quantity::damping)] *= stiffness * damping;
          one[index_of(Quantity::friction)] *= friction;
          const double cost = cost_of(one, training_);
          if (cost < best_cost) best_cost = cost, best = one;
        }
      }
    }
  }
  return best;
}

// Levenberg-Marquardt with Marquardt's scaling and Nielsen's update of the damping.
ServoValues Fitter::minimised(ServoValues values, const std::vector<Quantity>& free, const Mask& mask) {
  const auto m = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd weights(residuals_.size());
  for (Eigen::Index i = 0; i < weights.size(); ++i)
    weights[i] = mask[static_cast<std::size_t>(i)] != 0 ? independence_[i] : 0.0;
  double lambda = 1e-2, growth = 2, cost = cost_of(values, mask);
  constexpr int kIterations = 40, kTrials = 10;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    jacobian(values, free);
    Eigen::MatrixXd H = jacobian_.transpose() * weights.asDiagonal() * jacobian_;
    Eigen::VectorXd g = jacobian_.transpose() * weights.cwiseProduct(residuals_);
    for (Eigen::Index j = 0; j < m; ++j) {
      const std::size_t i = index_of(free[static_cast<std::size_t>(j)]);
      H(j, j) += prior_;
      g[j] -= prior_ * std::log(values[i] / options_.start[i]);
    }
    const double before = cost;
    bool better = false;
    for (int trial = 0; trial < kTrials && !better; ++trial) {
      Eigen::MatrixXd damped = H;
      damped.diagonal() += lambda * H.diagonal();
      const Eigen::VectorXd way = damped.ldlt().solve(g).cwiseMax(-1.5).cwiseMin(1.5);
      ServoValues next = values;
      for (Eigen::Index j = 0; j < m; ++j) {
        const std::size_t i = index_of(free[static_cast<std::size_t>(j)]);
        next[i] = std::clamp(values[i] * std::exp(way[j]), kBounds[i].low, kBounds[i].high);
      }
      const double reached = cost_of(next, mask);
      if (reached < cost) {
        better = true;
        cost = reached;
        values = next;
        lambda = std::max(lambda / 5, 1e-7);
        growth = 2;
      } else {
        lambda *= growth;
        growth *= 2;
      }
    }
    if (!better || before - cost < 1e-7 * before) break;
  }
  cost_of(values, mask);
  return values;
}

// Starts for the parameters that a rung adds.
ServoValues Fitter::from_below(const ServoValues& values, FrictionRung rung) const {
  ServoValues out = values;
  const double friction = std::max(values[index_of(Quantity::friction)], 1e-5);
  const auto set = [&](Quantity quantity, double value) {
    if (!(out[index_of(quantity)] > 0))
      out[index_of(quantity)] =
          std::clamp(value, kBounds[index_of(quantity)].low * 2, kBounds[index_of(quantity)].high / 2);
  };
  if (rung >= FrictionRung::coulomb) {
    set(Quantity::friction, options_.start[index_of(Quantity::friction)]);
    set(Quantity::viscous, options_.start[index_of(Quantity::viscous)]);
  }
  if (rung >= FrictionRung::stribeck) {
    set(Quantity::breakaway, 0.3 * friction);
    set(Quantity::stribeck, 0.1);
  }
  if (rung >= FrictionRung::load) set(Quantity::load_factor, 0.05);
  if (rung >= FrictionRung::backlash) set(Quantity::backlash, 2 * tick_ + 1e-4);
  return out;
}

void Fitter::climb(ServoFit& out, ServoValues& best) {
  const double n = std::accumulate(training_.begin(), training_.end(), 0.0);
  ServoValues values = screened();
  double best_bic = 0, best_held_out = 0;
  for (int r = static_cast<int>(FrictionRung::none); r <= static_cast<int>(options_.last); ++r) {
    const auto rung = static_cast<FrictionRung>(r);
    const std::vector<Quantity> free = quantities_of(rung);
    values = minimised(from_below(without_upper_rungs(r > 0 ? best : values, rung), rung), free, training_);
    RungResult result{rung, rms_of(training_), rms_of(held_out_), 0};
    result.bic = n * std::log(result.training_rms * result.training_rms) +
                 static_cast<double>(free.size()) * std::log(n);
    // Samples are counted as independent, which correlated residuals are not; the margin keeps a rung that
    // only fits their noise away.
    const bool wins =
        out.ladder.empty() || (result.bic < best_bic - 10 && result.held_out_rms < best_held_out * 0.9995);
    out.ladder.push_back(result);
    if (!wins) continue;
    best = values;
    best_bic = result.bic;
    best_held_out = result.held_out_rms;
    out.rung = rung;
    out.held_out_rms = result.held_out_rms;
  }
}

// The residuals of a sound model are within half a tick of the prediction. Ljung-Box' test is of the samples
// in motion, whose rounding errors are independent.
void Fitter::judge_residuals(ServoFit& out) const {
  const std::span<const double> r(residuals_.data(), static_cast<std::size_t>(residuals_.size()));
  const identification_detail::LjungBox box = identification_detail::ljung_box(r, moving_, kLags);
  out.ljung_box = box.statistic;
  out.white_probability = box.probability;
  const double resolution = std::max(0.5 * tick_, kNegligible);
  double beyond = 0, sum = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (all_[i] == 0) continue;
    const double over = std::max(std::abs(r[i]) - resolution, 0.0);
    beyond += over * over;
    sum += r[i] * r[i];
  }
  out.structure = sum > 0 ? beyond / sum : 0;
  out.is_white = out.structure <= kMaxStructure;
  if (!out.is_white) {
    out.warnings.push_back(
        fmt::format("the residuals are not those of rounding: {:.1f} % of their variance is beyond the "
                    "resolution, rms {:.2f} "
                    "ticks (rounding alone: 0.29); the servo has effects that the model {} does not have, so "
                    "that the values "
                    "may be wrong although the error is small",
                    100 * out.structure, out.rms / std::max(tick_, 2 * kNegligible), name_of(out.rung)));
  }
  for (const Quantity quantity : out.at_bound)
    out.warnings.push_back(fmt::format("{} is at the bound of its range", name_of(quantity)));
}

constexpr const char* kScaleFix =
    "lay the arm down, or record it a second time with a known weight (--payload 200g) and fit both";
constexpr const char* kOneNumber =
    "not identifiable alone, because drive damping and viscous friction are one number in this motion: "
    "record a "
    "release of the torque (doppel identify plan and record --plan)";
constexpr const char* kYields = "not identifiable, because the other joints yield in fast motions";

// `lost`: what the inertia is smaller by where the other joints yield.
bool is_hidden(Quantity quantity, double lost, double inertia, double armature) {
  if (quantity == Quantity::effort) return lost > kMaxYielding * (inertia + armature);
  return quantity == Quantity::armature && lost > kIdentified * armature;
}

// Only while the torque is off one of them acts without the other.
bool Fitter::is_one_number(const ServoFit& fit, Quantity quantity) const {
  if (!record_.released.empty()) return false;
  if (quantity != Quantity::damping && quantity != Quantity::viscous) return false;
  return std::ranges::any_of(fit.correlated, [](const CorrelatedPair& pair) {
    return pair.a == Quantity::damping && pair.b == Quantity::viscous;
  });
}

// The information about the logarithm of the scale, by one difference of the whole direction: the sum of the
// parameters' own differences is not zero where the scale has no effect, but the error of those differences.
double Fitter::scale_information(const ServoValues& values, double inertia) {
  const double armature = values[index_of(Quantity::armature)];
  const double step = std::min(3e-2, 0.5 * std::log1p(armature / std::max(inertia, 1e-12)));
  if (!(step > 0)) return 0;
  const auto scaled = [&](double factor) {
    ServoValues out = values;
    for (const Quantity effort : {Quantity::effort, Quantity::stiffness, Quantity::damping, Quantity::viscous,
                                  Quantity::friction, Quantity::breakaway})
      out[index_of(effort)] *= factor;
    out[index_of(Quantity::armature)] = factor * (armature + inertia) - inertia;
    simulation_.run(out, shifted_);
    ++simulations_;
  };
  scaled(std::exp(step));
  const std::vector<double> above = shifted_;
  scaled(std::exp(-step));
  double out = 0;
  for (std::size_t i = 0; i < above.size(); ++i) {
    const double slope = (above[i] - shifted_[i]) / (2 * step);
    if (all_[i] != 0) out += independence_[static_cast<Eigen::Index>(i)] * slope * slope;
  }
  return out;
}

void Fitter::name_problems(ServoFit& out, const std::vector<Quantity>& free, const ServoValues& values,
                           const Eigen::MatrixXd& covariance, double noise) {
  // The scale: all efforts and the whole inertia multiplied by one factor.
  const auto m = static_cast<Eigen::Index>(free.size());
  double inertia = 0;
  for (const double one : record_.inertia) inertia += one;
  inertia /= static_cast<double>(record_.inertia.size());
  const double armature = out[Quantity::armature].value;
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(m);
  for (Eigen::Index j = 0; j < m; ++j) {
    switch (free[static_cast<std::size_t>(j)]) {
      case Quantity::effort:
      case Quantity::stiffness:
      case Quantity::damping:
      case Quantity::viscous:
      case Quantity::friction:
      case Quantity::breakaway:
      case Quantity::armature:
        scale[j] = 1;
        break;
      default:
        break;
    }
  }
  const double along = scale_information(values, inertia);
  const double width = kCoverage * noise / std::sqrt(std::max(along, 1e-300));
  const Eigen::Index k =
      static_cast<Eigen::Index>(std::ranges::find(free, Quantity::stiffness) - free.begin());
  out.scale_known = width < kIdentified && kCoverage * std::sqrt(covariance(k, k)) < 2 * kIdentified;
  const auto [least, most] = std::ranges::minmax(record_.load);
  const double lost = record_.yielding * inertia;
  for (Eigen::Index j = 0; j < m; ++j) {
    const Quantity quantity = free[static_cast<std::size_t>(j)];
    FittedValue& value = out.values[index_of(quantity)];
    const double half = kCoverage * std::sqrt(covariance(j, j));
    if (quantity == Quantity::velocity && out.velocity_share < kRareLimit) {
      value.problem = "not identifiable, because the velocity limit was never reached: use larger steps";
    } else if (quantity == Quantity::effort && out.effort_share < kRareLimit) {
      value.problem =
          "not identifiable, because the effort limit was never reached: add a weight, "
          "or keep the data sheet's";
    } else if (scale[j] != 0 && !out.scale_known) {
      value.problem = fmt::format("scale not identifiable, because {}: {}",
                                  most - least < 1e-9 * (1 + std::abs(most))
                                      ? "the axis is vertical"
                                      : "gravity's moment varies too little over the motion",
                                  kScaleFix);
    } else if (is_hidden(quantity, lost, inertia, armature)) {
      value.problem = fmt::format("{}, by {:.0f} % of the inertia", kYields, 100 * record_.yielding);
    } else if (is_one_number(out, quantity)) {
      value.problem = kOneNumber;
    } else if (half > kIdentified) {
      value.problem = fmt::format(
          "not identifiable, because the motion does not excite it: the interval is a factor of {:.3g}",
          std::exp(std::min(half, 20.0)));
    }
  }
}

void Fitter::judge(ServoFit& out, const ServoValues& values) {
  const std::vector<Quantity> free = quantities_of(out.rung);
  cost_of(values, all_);
  out.velocity_share = simulation_.velocity_share();
  out.effort_share = simulation_.effort_share();
  out.rms = rms_of(all_);
  out.tick = tick_;
  jacobian(values, free);
  Eigen::VectorXd weights(residuals_.size());
  for (Eigen::Index i = 0; i < weights.size(); ++i)
    weights[i] = all_[static_cast<std::size_t>(i)] != 0 ? independence_[i] : 0.0;
  const auto m = static_cast<Eigen::Index>(free.size());
  const Eigen::MatrixXd J = weights.asDiagonal() * jacobian_;
  const Eigen::MatrixXd information = jacobian_.transpose() * J;
  const double noise = std::max(out.rms, floor_);
  Eigen::MatrixXd H = information;
  H.diagonal().array() += noise * noise / (kSpread * kSpread);
  const Eigen::MatrixXd inverse = H.ldlt().solve(Eigen::MatrixXd::Identity(m, m));
  const int lags = static_cast<int>(residuals_.size()) / 50;
  Eigen::MatrixXd scores = identification_detail::long_run_scores(J, residuals_, lags);
  scores.diagonal().array() += noise * noise * noise * noise / (kSpread * kSpread);
  const Eigen::MatrixXd plain = noise * noise * inverse;
  const Eigen::MatrixXd robust = inverse * scores * inverse;
  Eigen::MatrixXd covariance = robust;
  // A window of finite length can only underestimate: never narrower than with white residuals.
  double inflation = 0;
  for (Eigen::Index j = 0; j < m; ++j) {
    const double factor = std::max(robust(j, j) / plain(j, j), 1.0);
    inflation += factor / static_cast<double>(m);
    const double widen = std::sqrt(factor * plain(j, j) / std::max(robust(j, j), 1e-300));
    covariance.row(j) *= widen;
    covariance.col(j) *= widen;
  }
  out.inflation = inflation;
  for (std::size_t i = 0; i < kServoQuantities; ++i)
    out.values[i] = {values[i], values[i], values[i], false, ""};
  for (Eigen::Index j = 0; j < m; ++j) {
    const std::size_t i = index_of(free[static_cast<std::size_t>(j)]);
    const double half = kCoverage * std::sqrt(covariance(j, j));
    out.values[i] = {values[i], values[i] * std::exp(-half), values[i] * std::exp(half), true, ""};
    if (values[i] < kBounds[i].low * 1.01 || values[i] > kBounds[i].high / 1.01)
      out.at_bound.push_back(free[static_cast<std::size_t>(j)]);
    for (Eigen::Index k = 0; k < j; ++k) {
      const double r = plain(j, k) / std::sqrt(plain(j, j) * plain(k, k));
      if (std::abs(r) > kHighCorrelation)
        out.correlated.push_back({free[static_cast<std::size_t>(k)], free[static_cast<std::size_t>(j)], r});
    }
  }
  name_problems(out, free, values, covariance, noise * std::sqrt(inflation));
  judge_residuals(out);
}

// Delay, viscous friction and armature shift the response in almost the same way, so that the minimum lies
// in a narrow valley. It is searched from several places along the valley.
ServoValues Fitter::settled(const ServoValues& values, const std::vector<Quantity>& free) {
  ServoValues best = minimised(values, free, all_);
  double best_cost = cost_of(best, all_);
  minima_ = {{best, best_cost}};
  if (free.size() < index_of(Quantity::friction)) return best;
  const auto try_start = [&](const ServoValues& start) {
    const ServoValues one = minimised(start, free, all_);
    const double cost = cost_of(one, all_);
    minima_.push_back({one, cost});
    if (cost < best_cost) best_cost = cost, best = one;
  };
  // A limit that does not act has no gradient, although a lower one would fit better.
  if (simulation_.effort_share() == 0) {
    ServoValues start = best;
    start[index_of(Quantity::effort)] =
        std::max(kLowerEffort * simulation_.largest_effort(), kBounds[index_of(Quantity::effort)].low);
    try_start(start);
  }
  // Without the releases only the sum of both may be known.
  if (!record_.released.empty()) {
    ServoValues start = best;
    const double viscous = options_.start[index_of(Quantity::viscous)];
    const double sum = best[index_of(Quantity::damping)] + best[index_of(Quantity::viscous)];
    start[index_of(Quantity::viscous)] = std::min(viscous, 0.9 * sum);
    start[index_of(Quantity::damping)] = sum - start[index_of(Quantity::viscous)];
    try_start(start);
    // A limit that the other motions do not reach is anywhere.
    start[index_of(Quantity::velocity)] = options_.start[index_of(Quantity::velocity)];
    try_start(start);
  }
  const ServoValues middle = best;
  for (const double factor : {0.3, 2.5}) {
    ServoValues start = middle;
    double& viscous = start[index_of(Quantity::viscous)];
    const double added = std::max(viscous, 0.02 * start[index_of(Quantity::damping)]) * (factor - 1);
    viscous = std::clamp(viscous + added, kBounds[index_of(Quantity::viscous)].low,
                         kBounds[index_of(Quantity::viscous)].high);
    double& delay = start[index_of(Quantity::delay)];
    delay = std::clamp(delay - added / start[index_of(Quantity::stiffness)],
                       kBounds[index_of(Quantity::delay)].low, kBounds[index_of(Quantity::delay)].high);
    try_start(start);
  }
  return best;
}

// An interval contains every minimum that fits the data about as well as the best.
void Fitter::widen(ServoFit& out) const {
  double best = 1e300;
  for (const Evaluation& one : minima_) best = std::min(best, one.cost);
  double weight = 0;
  for (std::size_t i = 0; i < all_.size(); ++i)
    weight += all_[i] != 0 ? independence_[static_cast<Eigen::Index>(i)] : 0.0;
  const double variance = best / std::max(weight, 1.0);
  constexpr double kAsGood = 10.0;  // of -2 log likelihood, before the inflation
  for (const Evaluation& one : minima_) {
    if (one.cost - best > kAsGood * variance * out.inflation) continue;
    for (std::size_t i = 0; i < kServoQuantities; ++i) {
      FittedValue& value = out.values[i];
      if (!value.fitted) continue;
      value.low = std::min(value.low, one.values[i] * value.low / value.value);
      value.high = std::max(value.high, one.values[i] * value.high / value.value);
    }
  }
}

ServoFit Fitter::run() {
  ServoFit out;
  ServoValues best{};
  climb(out, best);
  best = settled(best, quantities_of(out.rung));
  judge(out, best);
  widen(out);
  cost_of(best, all_);
  out.predicted = predicted_;
  out.simulations = simulations_;
  return out;
}

}  // namespace

ServoFit fit_servo(const JointRecord& record, const FitOptions& options) {
  identification_detail::check_record(record);
  Fitter fitter(record, options);
  return fitter.run();
}

}  // namespace doppel
