#pragma once
// Checks of inertia tensors: whether one is physically possible, and which single typo explains it.

#include <array>
#include <optional>
#include <string>

#include "doppel/description/overlay/operation.h"
#include "doppel/review/audit/detail/description_facts.h"

namespace doppel::audit_rules {

using Components = std::array<double, 6>;  // ixx ixy ixz iyy iyz izz
inline constexpr std::array<const char*, 6> kComponentNames{"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
inline constexpr std::array<std::size_t, 3> kDiagonal{0, 3, 5};

Components components_of(const Inertial& inertial);
Eigen::Matrix3d tensor_of(const Components& c);
Eigen::Vector3d principal_moments(const Components& c);  // ascending

// The excess of the largest moment over the sum of the others, as a part of the largest; negative: it does not.
double triangle_excess(const Eigen::Vector3d& moments);
bool possible(const Components& c);

// The tensor of a solid, homogeneous body of this shape and mass about its centre of mass.
Eigen::Matrix3d expected_tensor(const LinkShape& shape, double mass);

struct TensorTypo {
  Components corrected;
  std::string what;  // "the sign of iyy"
};
// The one change of a sign, a power of ten or two exchanged components that makes the tensor possible and,
// with a shape, plausible; nothing where there is none or more than one.
std::optional<TensorTypo> only_typo(const Components& written, const Inertial& inertial,
                                    const std::optional<LinkShape>& shape);

Operation set_components(const std::string& link, const Components& was, const Components& now,
                         std::string why);

}  // namespace doppel::audit_rules
