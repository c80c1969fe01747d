#include "doppel/review/identification/detail/fit_statistics.h"

#include <cmath>

namespace doppel::identification_detail {

double chi_squared_tail(double x, int degrees) {
  // Regularised incomplete gamma function Q(a, z) by its series, or by its continued fraction (Lentz).
  const double a = 0.5 * degrees, z = 0.5 * x;
  if (!(z > 0)) return 1;
  const double front = std::exp(a * std::log(z) - z - std::lgamma(a));
  constexpr int kTerms = 500;
  constexpr double kEnough = 1e-14;
  if (z < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < kTerms && std::abs(term) > kEnough * sum; ++n) sum += term *= z / (a + n);
    return std::max(0.0, 1 - front * sum);
  }
  double b = z + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int n = 1; n < kTerms; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    const double change = c * d;
    h *= change;
    if (std::abs(change - 1) < kEnough) break;
  }
  return front * h;
}

LjungBox ljung_box(std::span<const double> residuals, const std::vector<char>& marked, int lags) {
  LjungBox out;
  double mean = 0, n = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (marked[i] == 0) continue;
    mean += residuals[i];
    n += 1;
  }
  if (n < 3.0 * lags) return out;
  mean /= n;
  double variance = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (marked[i] != 0) variance += (residuals[i] - mean) * (residuals[i] - mean);
  }
  variance /= n;
  if (!(variance > 0)) return out;
  for (int lag = 1; lag <= lags; ++lag) {
    double sum = 0, pairs = 0;
    for (std::size_t i = static_cast<std::size_t>(lag); i < residuals.size(); ++i) {
      const std::size_t j = i - static_cast<std::size_t>(lag);
      if (marked[i] == 0 || marked[j] == 0) continue;
      sum += (residuals[i] - mean) * (residuals[j] - mean);
      pairs += 1;
    }
    if (!(pairs > 1)) continue;
    const double rho = sum / pairs / variance;
    if (lag == 1) out.first = rho;
    out.statistic += rho * rho * pairs * (n + 2) / n;
  }
  out.probability = chi_squared_tail(out.statistic, lags);
  return out;
}

Eigen::MatrixXd long_run_scores(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals, int lags) {
  const Eigen::MatrixXd scores = residuals.asDiagonal() * jacobian;
  const Eigen::Index n = scores.rows();
  Eigen::MatrixXd out = scores.transpose() * scores;
  for (Eigen::Index lag = 1; lag <= lags && lag < n; ++lag) {
    const double weight = 1.0 - static_cast<double>(lag) / (lags + 1.0);
    const Eigen::MatrixXd cross = scores.bottomRows(n - lag).transpose() * scores.topRows(n - lag);
    out += weight * (cross + cross.transpose());
  }
  return out;
}

}  // namespace doppel::identification_detail
