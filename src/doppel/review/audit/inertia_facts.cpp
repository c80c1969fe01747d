#include "doppel/review/audit/detail/inertia_facts.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace doppel::audit_rules {
namespace {

constexpr double kPossibleSlack = 1e-6;  // the rounding of few digits
constexpr double kPlausible = 2;         // moments of a machine part against those of its solid shape

bool plausible(const Components& c, const Eigen::Matrix3d& expected) {
  const Eigen::Matrix3d I = tensor_of(c);
  for (int i = 0; i < 3; ++i) {
    const double ratio = I(i, i) / expected(i, i);
    if (!(ratio < kPlausible && ratio > 1 / kPlausible)) return false;
  }
  return true;
}

std::vector<TensorTypo> typos(const Components& c) {
  std::vector<TensorTypo> out;
  for (std::size_t i = 0; i < 6; ++i) {
    if (c[i] == 0) continue;
    TensorTypo sign{c, fmt::format("the sign of {}", kComponentNames[i])};
    sign.corrected[i] = -c[i];
    out.push_back(sign);
    for (const int power : {-3, -2, -1, 1, 2, 3}) {
      TensorTypo tenfold{c, fmt::format("a power of ten in {}", kComponentNames[i])};
      // Divided by a whole power, 965 becomes 96.5 and not 96.50000000000001.
      tenfold.corrected[i] = power > 0 ? c[i] * std::pow(10.0, power) : c[i] / std::pow(10.0, -power);
      out.push_back(tenfold);
    }
    for (std::size_t j = i + 1; j < 6; ++j) {
      TensorTypo exchanged{c, fmt::format("{} and {} exchanged", kComponentNames[i], kComponentNames[j])};
      std::swap(exchanged.corrected[i], exchanged.corrected[j]);
      out.push_back(exchanged);
    }
  }
  return out;
}

}  // namespace

Components components_of(const Inertial& i) {
  return {i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz};
}

Eigen::Matrix3d tensor_of(const Components& c) {
  Eigen::Matrix3d I;
  I << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return I;
}

Eigen::Vector3d principal_moments(const Components& c) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor_of(c), Eigen::EigenvaluesOnly).eigenvalues();
}

double triangle_excess(const Eigen::Vector3d& moments) {
  return moments[2] > 0 ? (moments[2] - moments[1] - moments[0]) / moments[2] : 0.0;
}

bool possible(const Components& c) {
  const Eigen::Vector3d moments = principal_moments(c);
  return moments[0] > 0 && triangle_excess(moments) <= kPossibleSlack;
}

Eigen::Matrix3d expected_tensor(const LinkShape& shape, double mass) {
  if (shape.solid.volume > 0) return shape.solid.unit.I * (mass / shape.solid.volume);
  const Eigen::Vector3d s = shape.bounds.sizes().cwiseAbs2() * (mass / 12.0);
  return Eigen::Vector3d(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()).asDiagonal();
}

std::optional<TensorTypo> only_typo(const Components& written, const Inertial& inertial,
                                    const std::optional<LinkShape>& shape) {
  std::optional<Eigen::Matrix3d> expected;
  if (shape && inertial.mass > 0) {
    const Eigen::Matrix3d R = rotation_from_rpy(inertial.origin.rpy);
    expected = R.transpose() * expected_tensor(*shape, inertial.mass) * R;
  }
  std::vector<TensorTypo> fitting;
  for (TensorTypo& typo : typos(written)) {
    if (!possible(typo.corrected) || (expected && !plausible(typo.corrected, *expected))) continue;
    const bool known = std::any_of(fitting.begin(), fitting.end(), [&](const TensorTypo& other) {
      return other.corrected == typo.corrected;
    });
    if (!known) fitting.push_back(std::move(typo));
  }
  return fitting.size() == 1 ? std::optional(std::move(fitting.front())) : std::nullopt;
}

Operation set_components(const std::string& link, const Components& was, const Components& now,
                         std::string why) {
  SetInertia action;
  action.link = link;
  for (std::size_t i = 0; i < 6; ++i) {
    if (was[i] != now[i]) action.components[kComponentNames[i]] = now[i];
  }
  Operation out;
  out.action = std::move(action);
  out.why = std::move(why);
  return out;
}

}  // namespace doppel::audit_rules
