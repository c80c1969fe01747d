#pragma once
// A Gaussian filter without a delay.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace doppel::identification_detail {

inline constexpr double kFilterReach = 4;  // sigmas

inline Eigen::Index low_pass_reach(double sigma) {
  return static_cast<Eigen::Index>(std::ceil(kFilterReach * sigma));
}

// Each column; sigma in samples. At the ends the values beyond are those of the ends.
inline Eigen::MatrixXd low_passed(const Eigen::MatrixXd& values, double sigma) {
  const Eigen::Index reach = low_pass_reach(sigma), n = values.rows();
  Eigen::VectorXd kernel(2 * reach + 1);
  for (Eigen::Index i = -reach; i <= reach; ++i) {
    const double x = static_cast<double>(i) / sigma;
    kernel[i + reach] = std::exp(-0.5 * x * x);
  }
  kernel /= kernel.sum();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, values.cols());
  for (Eigen::Index k = -reach; k <= reach; ++k) {
    for (Eigen::Index i = 0; i < n; ++i)
      out.row(i) += kernel[k + reach] * values.row(std::clamp<Eigen::Index>(i + k, 0, n - 1));
  }
  return out;
}

}  // namespace doppel::identification_detail
