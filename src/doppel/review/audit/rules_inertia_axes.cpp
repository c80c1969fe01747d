// Moments about the wrong axes: each is bounded by how far the shape reaches from its axis.
#include <algorithm>
#include <cmath>

#include "doppel/review/audit/detail/inertia_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kFits = 2;                       // moments of a part against those of its solid shape
constexpr double kSame = 1.05, kOtherwise = 1.1;  // the only order: it fits, and no other one does
using Order = std::array<int, 3>;                 // the moment about axis i stands where axis order[i] should

// The excess of the moment about the worst axis over what the shape allows, as a ratio of radii.
struct Worst {
  int axis = 0;
  double gyration = 0, reach = 0;
  [[nodiscard]] double excess() const { return reach > 0 ? gyration / reach : 0.0; }
};

Worst worst_axis(const Eigen::Matrix3d& I, const Inertial& inertial, const LinkShape& shape) {
  const Eigen::Matrix3d R = rotation_from_rpy(inertial.origin.rpy);
  Worst out;
  for (int axis = 0; axis < 3; ++axis) {
    Worst here{axis, std::sqrt(I(axis, axis) / inertial.mass), 0};
    for (const Eigen::Vector3d& p : shape.hull) {
      const Eigen::Vector3d arm = p - inertial.origin.xyz;
      here.reach = std::max(here.reach, (arm - R.col(axis) * R.col(axis).dot(arm)).norm());
    }
    if (here.excess() > out.excess()) out = here;
  }
  return out;
}

Components reordered(const Components& c, const Order& order) {
  const Eigen::Matrix3d I = tensor_of(c);
  const auto at = [&](int i, int j) { return I(order[i], order[j]); };
  return {at(0, 0), at(0, 1), at(0, 2), at(1, 1), at(1, 2), at(2, 2)};
}

// The ratio by which the worst moment differs from that of the solid shape.
double misfit(const Components& c, const Eigen::Matrix3d& expected) {
  double out = 1;
  for (int i = 0; i < 3; ++i) {
    const double ratio = tensor_of(c)(i, i) / expected(i, i);
    out = std::max({out, ratio, 1 / ratio});
  }
  return out;
}

std::string what_happened(const Order& order) {
  for (int fixed = 0; fixed < 3; ++fixed) {
    if (order[fixed] != fixed) continue;
    const char *a = kAxisNames[fixed == 0 ? 1 : 0], *b = kAxisNames[fixed == 2 ? 1 : 2];
    return fmt::format("i{0}{0} and i{1}{1} are exchanged", a, b);
  }
  return "ixx, iyy and izz stand in another order";
}

struct Reordering {
  Components corrected;
  std::string what;
  double misfit = 0;
  bool only = false;  // it fits closely, and no other one does
};

std::optional<Reordering> reordering(const Components& c, const Eigen::Matrix3d& expected) {
  constexpr std::array<Order, 5> orders{{{1, 0, 2}, {2, 1, 0}, {0, 2, 1}, {1, 2, 0}, {2, 0, 1}}};
  std::optional<Reordering> best;
  for (const Order& order : orders) {
    const Components corrected = reordered(c, order);
    const double apart = misfit(corrected, expected);
    if (apart < kFits && (!best || apart < best->misfit))
      best = Reordering{corrected, what_happened(order), apart, apart < kSame};
  }
  if (!best) return best;
  for (const Order& order : orders) {
    const Components other = reordered(c, order);
    const bool different = misfit(other, tensor_of(best->corrected)) > 1 + 1e-3;
    if (different && misfit(other, expected) < kOtherwise) best->only = false;
  }
  return best;
}

}  // namespace

bool check_axes(const Link& link, const LinkShape& shape, Findings& out) {
  const Inertial& inertial = *link.inertial;
  const Components c = components_of(inertial);
  const Worst worst = worst_axis(tensor_of(c), inertial, shape);
  if (worst.excess() <= kMaxGyrationRatio) return false;
  std::optional<Reordering> found;
  if (shape.solid.volume > 0) {
    const Eigen::Matrix3d R = rotation_from_rpy(inertial.origin.rpy);
    found = reordering(c, R.transpose() * expected_tensor(shape, inertial.mass) * R);
  }
  if (!found) return false;
  Finding& f = out.add(
      "inertia.axes", found->only ? Severity::error : Severity::warning, subject(link), inertial.source,
      fmt::format("its moment about {} implies mass at {:.3g} mm from that axis, but no point of its shape "
                  "is more than {:.3g} mm away",
                  kAxisNames[static_cast<std::size_t>(worst.axis)], worst.gyration * 1e3, worst.reach * 1e3),
      found->only ? fmt::format("{}: write ixx=\"{:g}\" iyy=\"{:g}\" izz=\"{:g}\"", found->what,
                                found->corrected[0], found->corrected[3], found->corrected[5])
                  : "");
  if (found->only) f.repair = {set_components(link.name, c, found->corrected, found->what)};
  return true;
}

}  // namespace doppel::audit_rules
