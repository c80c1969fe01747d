#include "doppel/review/identification/detail/physical_bodies.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace doppel::identification_detail {
namespace {

constexpr double kThinnest = 1e-6;    // of a body's second moments, along its thinnest direction
constexpr double kDriveSpread = 3.0;  // of the logarithm of a drive's value
constexpr double kDifference = 1e-6;  // of a place
constexpr int kMaxSteps = 200;
constexpr double kMaxPlaceStep = 0.5;
constexpr double kConverged = 1e-10;  // of the cost

// The upper triangular U with U U' = J.
Eigen::Matrix4d upper_factor(const Eigen::Matrix4d& J) {
  const Eigen::Matrix4d turned = J.reverse();
  const Eigen::Matrix4d L = turned.llt().matrixL();
  return L.reverse();
}

Eigen::Matrix4d triangle_of(const InertialParameters& x) {
  Eigen::Matrix4d E = Eigen::Matrix4d::Zero();
  for (int i = 0; i < 4; ++i) E(i, i) = std::exp(x[i]);
  E(0, 1) = x[4], E(0, 2) = x[5], E(1, 2) = x[6];
  E(0, 3) = x[7], E(1, 3) = x[8], E(2, 3) = x[9];
  return E;
}

}  // namespace

Eigen::Matrix4d pseudo_inertia(const InertialParameters& p) {
  Eigen::Matrix3d I;
  I << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
  Eigen::Matrix4d J;
  J.topLeftCorner<3, 3>() = 0.5 * I.trace() * Eigen::Matrix3d::Identity() - I;
  J.topRightCorner<3, 1>() = p.segment<3>(1);
  J.bottomLeftCorner<1, 3>() = p.segment<3>(1).transpose();
  J(3, 3) = p[0];
  return J;
}

InertialParameters parameters_of(const Eigen::Matrix4d& J) {
  const Eigen::Matrix3d Sigma = J.topLeftCorner<3, 3>();
  const Eigen::Matrix3d I = Sigma.trace() * Eigen::Matrix3d::Identity() - Sigma;
  InertialParameters out;
  out << J(3, 3), J.topRightCorner<3, 1>(), I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2);
  return out;
}

// Points and rods have no extent in some direction; it is made thin, since the logarithm of zero is nowhere.
BodySpace::BodySpace(const InertialParameters& described) {
  MassProperties body = mass_properties(described);
  const Eigen::Matrix3d Sigma = 0.5 * body.I.trace() * Eigen::Matrix3d::Identity() - body.I;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(Sigma);
  const double extent = std::max(axes.eigenvalues().maxCoeff(), kThinnest * body.mass);  // at least 1 mm
  const Eigen::Vector3d moments = axes.eigenvalues().cwiseMax(kThinnest * extent);
  const Eigen::Matrix3d thick = axes.eigenvectors() * moments.asDiagonal() * axes.eigenvectors().transpose();
  body.I = thick.trace() * Eigen::Matrix3d::Identity() - thick;
  factor_ = upper_factor(pseudo_inertia(inertial_parameters(body)));
}

InertialParameters BodySpace::at(const InertialParameters& place) const {
  const Eigen::Matrix4d U = factor_ * triangle_of(place);
  return parameters_of(U * U.transpose());
}

Eigen::Matrix<double, kInertialParameters, kInertialParameters> BodySpace::slope(
    const InertialParameters& place) const {
  Eigen::Matrix<double, kInertialParameters, kInertialParameters> out;
  for (int i = 0; i < kInertialParameters; ++i) {
    InertialParameters above = place, below = place;
    above[i] += kDifference;
    below[i] -= kDifference;
    out.col(i) = (at(above) - at(below)) / (2 * kDifference);
  }
  return out;
}

namespace {

class BodySearch {
 public:
  BodySearch(const CombinationCost& cost, const Eigen::VectorXd& described, int bodies)
      : cost_(cost), described_(described), weights_(Eigen::VectorXd::Ones(described.size())) {
    for (int i = 0; i < bodies; ++i) spaces_.emplace_back(described.segment<kInertialParameters>(first(i)));
    const Eigen::Index drives = described.size() - first(bodies);
    weights_.tail(drives).setConstant(1 / (kDriveSpread * kDriveSpread));
  }

  [[nodiscard]] Eigen::VectorXd parameters(const Eigen::VectorXd& x) const {
    Eigen::VectorXd out = described_;
    for (std::size_t i = 0; i < spaces_.size(); ++i)
      out.segment<kInertialParameters>(first(i)) = spaces_[i].at(x.segment<kInertialParameters>(first(i)));
    for (Eigen::Index i = first(spaces_.size()); i < x.size(); ++i) out[i] = described_[i] * std::exp(x[i]);
    return out;
  }

  // Levenberg-Marquardt.
  [[nodiscard]] Eigen::VectorXd run() const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(described_.size());
    double least = cost_at(x), damping = 1e-3;
    for (int step = 0; step < kMaxSteps && damping < 1e12; ++step) {
      const Eigen::MatrixXd J = slope(x);
      const Eigen::VectorXd p = parameters(x);
      const Eigen::VectorXd g =
          J.transpose() * (cost_.H * (cost_.b - cost_.B * p)) - weights_.cwiseProduct(x);
      Eigen::MatrixXd A = J.transpose() * cost_.H * J;
      A.diagonal() += weights_;
      A.diagonal() *= 1 + damping;
      Eigen::VectorXd way = A.ldlt().solve(g);
      way *= std::min(1.0, kMaxPlaceStep / std::max(way.cwiseAbs().maxCoeff(), 1e-300));
      const double reached = cost_at(x + way);
      if (!(reached < least)) {
        damping *= 4;
        continue;
      }
      x += way;
      const bool converged = least - reached < kConverged * (1 + least);
      least = reached;
      damping = std::max(damping / 5, 1e-9);
      if (converged) break;
    }
    return parameters(x);
  }

 private:
  static Eigen::Index first(std::size_t body) {
    return kInertialParameters * static_cast<Eigen::Index>(body);
  }
  static Eigen::Index first(int body) { return first(static_cast<std::size_t>(body)); }
  [[nodiscard]] double cost_at(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd e = cost_.b - cost_.B * parameters(x);
    const double sum = e.dot(cost_.H * e) + x.dot(weights_.cwiseProduct(x));
    return std::isfinite(sum) ? sum : 1e300;
  }
  // d combinations / d x.
  [[nodiscard]] Eigen::MatrixXd slope(const Eigen::VectorXd& x) const {
    Eigen::MatrixXd out(cost_.B.rows(), x.size());
    for (std::size_t i = 0; i < spaces_.size(); ++i) {
      out.middleCols<kInertialParameters>(first(i)) =
          cost_.B.middleCols<kInertialParameters>(first(i)) *
          spaces_[i].slope(x.segment<kInertialParameters>(first(i)));
    }
    for (Eigen::Index i = first(spaces_.size()); i < x.size(); ++i)
      out.col(i) = cost_.B.col(i) * described_[i] * std::exp(x[i]);
    return out;
  }

  const CombinationCost& cost_;
  const Eigen::VectorXd& described_;
  Eigen::VectorXd weights_;
  std::vector<BodySpace> spaces_;
};

}  // namespace

Eigen::VectorXd nearest_bodies(const CombinationCost& cost, const Eigen::VectorXd& described, int bodies) {
  return BodySearch(cost, described, bodies).run();
}

}  // namespace doppel::identification_detail
