#pragma once
// Statistics of residuals of a recording.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace doppel::identification_detail {

// Probability that a chi-squared variable of `degrees` is at least x.
double chi_squared_tail(double x, int degrees);

struct LjungBox {
  double statistic = 0, probability = 1, first = 0;  // first: autocorrelation of lag 1
};
// Over the lags 1..lags, of pairs whose samples are both marked.
LjungBox ljung_box(std::span<const double> residuals, const std::vector<char>& marked, int lags);

// Sum of the outer products of the scores J_t r_t over all lags, weights of Bartlett's window [p, p]
// (Newey and West 1987).
Eigen::MatrixXd long_run_scores(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals, int lags);

}  // namespace doppel::identification_detail
