// The wrist's centre depends on the first three joints only, and the rotation that is left on the last three.
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "doppel/robot/ik/detail/analytic_arm.h"
#include "doppel/robot/ik/detail/subproblems.h"

namespace doppel {
namespace {

constexpr double kSingular = 1e-4;

// c0 + c . (cos, sin) of an angle.
struct Harmonic {
  Eigen::Vector2d c;
  double c0 = 0;
};
// The position of a point that turns about an axis, from a point of joint 2's axis: its part along that axis,
// and half its squared distance.
struct Circle {
  Harmonic along, half_square;
};

Circle circle(const Eigen::Vector3d& v, const Eigen::Vector3d& h, const Eigen::Vector3d& offset, double sense,
              const Eigen::Vector3d& h2) {
  const Eigen::Vector3d K = h * h.dot(v) + offset, side = v - h * h.dot(v), up = sense * h.cross(v);
  Circle out;
  out.along = {{h2.dot(side), h2.dot(up)}, h2.dot(K)};
  out.half_square = {{K.dot(side), K.dot(up)}, 0.5 * (K.squaredNorm() + side.squaredNorm())};
  return out;
}

// The real roots of a polynomial of degree 4 in tan(x / 2), as angles.
int quartic_angles(const Eigen::Matrix<double, 5, 1>& polynomial, double* angles) {
  int degree = 4;
  const double largest = polynomial.cwiseAbs().maxCoeff();
  while (degree > 0 && std::abs(polynomial[degree]) <= 1e-12 * largest) --degree;
  int count = 0;
  for (int lost = degree; lost < 4 && count == 0; ++lost) angles[count++] = M_PI;  // a root at infinity
  if (degree == 0) return count;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
  for (int i = 0; i < degree; ++i) companion(i, degree - 1) = -polynomial[i] / polynomial[degree];
  for (int i = 1; i < degree; ++i) companion(i, i - 1) = 1;
  const Eigen::VectorXcd roots = companion.eigenvalues();
  for (int i = 0; i < degree; ++i) {
    if (std::abs(roots[i].imag()) < 1e-3 * (1 + std::abs(roots[i])))
      angles[count++] = 2 * std::atan(roots[i].real());
  }
  return count;
}

// The position problem of the first three joints: angles 1 and 3 for which both circles have the same part
// along axis 2 and the same distance from it. Source: Elias and Wen, sub-problem 5.
class PositionProblem {
 public:
  PositionProblem(const Circle& first, const Circle& third, double length, const RootMargin& margin)
      : margin_(margin) {
    const double scale = 1 / length;
    A_ << first.along.c.transpose(), first.half_square.c.transpose() * scale;
    B_ << third.along.c.transpose(), third.half_square.c.transpose() * scale;
    k_ << first.along.c0 - third.along.c0, (first.half_square.c0 - third.half_square.c0) * scale;
    size_ = length * length;
  }

  // Pairs of angles; returns their number, at most four.
  int solve(double (*pairs)[2]) {
    count_ = 0;
    pairs_ = pairs;
    if (std::abs(B_.determinant()) < kSingular * size_) {
      solve_separated(B_, A_, 1, false);
    } else if (std::abs(A_.determinant()) < kSingular * size_) {
      solve_separated(A_, B_, -1, true);
    } else {
      solve_general();
    }
    return count_;
  }

 private:
  // B x3 = A x1 + k, where the rows of B are dependent: one combination of the rows has no x3.
  void solve_separated(const Eigen::Matrix2d& B, const Eigen::Matrix2d& A, double sign, bool exchanged) {
    const int main = B.row(0).norm() > B.row(1).norm() ? 0 : 1, other = 1 - main;
    const double squared = B.row(main).squaredNorm();
    const double factor = squared > 0 ? B.row(other).dot(B.row(main)) / squared : 0;
    const Eigen::RowVector2d a = A.row(other) - factor * A.row(main);
    const double k = sign * (k_[other] - factor * k_[main]);
    const Angles first = solve_cosine(a[0], a[1], -k, margin_);
    for (int i = 0; i < first.count; ++i) {
      const double x = first.value[i];
      const double right = A(main, 0) * std::cos(x) + A(main, 1) * std::sin(x) + sign * k_[main];
      const Angles second = solve_cosine(B(main, 0), B(main, 1), right, margin_);
      for (int j = 0; j < second.count; ++j) {
        pairs_[count_][exchanged ? 1 : 0] = x;
        pairs_[count_++][exchanged ? 0 : 1] = second.value[j];
      }
    }
  }

  // |B^-1 (A x1 + k)|^2 = 1, a trigonometric polynomial of degree two.
  void solve_general() {
    const Eigen::Matrix2d D = B_.inverse() * A_;
    const Eigen::Vector2d e = B_.inverse() * k_;
    const double cc = D.col(0).squaredNorm(), ss = D.col(1).squaredNorm(), cs = 2 * D.col(0).dot(D.col(1));
    const double c1 = 2 * D.col(0).dot(e), s1 = 2 * D.col(1).dot(e), c0 = e.squaredNorm() - 1;
    Eigen::Matrix<double, 5, 1> polynomial;
    polynomial << cc + c1 + c0, 2 * (cs + s1), -2 * cc + 4 * ss + 2 * c0, 2 * (s1 - cs), cc - c1 + c0;
    double angles[4];
    const int roots = quartic_angles(polynomial, angles);
    for (int i = 0; i < roots; ++i) {
      const Eigen::Vector2d x3 = D * Eigen::Vector2d(std::cos(angles[i]), std::sin(angles[i])) + e;
      pairs_[count_][0] = angles[i];
      pairs_[count_++][1] = std::atan2(x3[1], x3[0]);
    }
  }

  RootMargin margin_;
  Eigen::Matrix2d A_, B_;
  Eigen::Vector2d k_;
  double size_ = 1;
  int count_ = 0;
  double (*pairs_)[2] = nullptr;
};

// The last three joints from the rotation that they make together.
void solve_wrist(const ArmAxes& axes, const Eigen::Matrix3d& R, const Branch& seed, const RootMargin& margin,
                 Branch branch, Branches& out) {
  const Eigen::Vector3d &h4 = axes.h[3], &h5 = axes.h[4], &h6 = axes.h[5];
  const Angles fifth = angles_to_plane(h4, h6, h5, h4.dot(R * h6), margin);
  for (int i = 0; i < fifth.count; ++i) {
    const Eigen::Matrix3d R5 = rotation_about(h5, fifth.value[i]);
    // With axes 4 and 6 in one line only the sum of their angles counts.
    const double fourth = angle_between(R5 * h6, R * h6, h4).value_or(seed[3]);
    const Eigen::Matrix3d rest = (rotation_about(h4, fourth) * R5).transpose() * R;
    const Eigen::Vector3d side = h6.unitOrthogonal();
    branch[3] = fourth;
    branch[4] = fifth.value[i];
    branch[5] = angle_between(side, rest * side, h6).value_or(seed[5]);
    out.add(branch);
  }
}

}  // namespace

void solve_spherical_wrist(const ArmAxes& axes, const Eigen::Vector3d& center, const Pose& X_BT,
                           const Branch& seed, const RootMargin& margin, Branches& out) {
  const Pose motion =
      X_BT * axes.M.inverse(Eigen::Isometry);  // of what is fixed to the tip, since position 0
  const Eigen::Vector3d target = motion * center;
  const Eigen::Vector3d &p1 = axes.p[0], &p2 = axes.p[1], &p3 = axes.p[2];
  const Circle first = circle(target - p1, axes.h[0], p1 - p2, -1, axes.h[1]);
  const Circle third = circle(center - p3, axes.h[2], p3 - p2, 1, axes.h[1]);
  const double length = (center - p3).norm() + (p3 - p2).norm() + (p2 - p1).norm();
  double pairs[4][2];
  const int count = PositionProblem(first, third, length, margin).solve(pairs);
  for (int i = 0; i < count; ++i) {
    Branch branch{};
    branch[0] = pairs[i][0];
    branch[2] = pairs[i][1];
    const Eigen::Matrix3d R1 = rotation_about(axes.h[0], branch[0]),
                          R3 = rotation_about(axes.h[2], branch[2]);
    const Eigen::Vector3d goal = R1.transpose() * (target - p1) + p1 - p2;
    branch[1] = angle_between(R3 * (center - p3) + p3 - p2, goal, axes.h[1]).value_or(seed[1]);
    const Eigen::Matrix3d R123 = R1 * rotation_about(axes.h[1], branch[1]) * R3;
    solve_wrist(axes, R123.transpose() * motion.linear(), seed, margin, branch, out);
  }
}

}  // namespace doppel
