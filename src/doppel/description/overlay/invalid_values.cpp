// Values that are invalid in every description: reported when the overlay is read, before
// anything is applied.
#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel::overlay_detail {
namespace {

using Found = std::optional<InvalidValue>;

Found negative(const char* key, const std::optional<double>& value) {
  if (!value || *value >= 0) return {};
  return InvalidValue{key, fmt::format("{} cannot be negative ({})", key, number_text(*value)),
                      fmt::format("did you mean {}?", number_text(-*value))};
}

Found not_positive(const char* key, const std::optional<double>& value, const char* instead) {
  if (auto found = negative(key, value)) return found;
  if (!value || *value > 0) return {};
  return InvalidValue{key, fmt::format("{} cannot be 0", key), instead};
}

Found first_of(std::initializer_list<Found> all) {
  const auto* found = std::ranges::find_if(all, [](const Found& one) { return one.has_value(); });
  return found != all.end() ? *found : std::nullopt;
}

Found problem_of(const SetAxis& a) {
  if (a.axis.norm() >= 1e-9) return {};
  return InvalidValue{"axis", "an axis of length 0 has no direction", "write for example 'axis: 0 0 1'"};
}

Found problem_of(const SetLimit& a) {
  if (a.lower && a.upper && *a.lower > *a.upper) {
    return InvalidValue{
        "lower", fmt::format("lower ({}) is above upper ({})", number_text(*a.lower), number_text(*a.upper)),
        fmt::format("did you mean lower {} and upper {}?", number_text(*a.upper), number_text(*a.lower))};
  }
  return first_of({negative("effort", a.effort), negative("velocity", a.velocity)});
}

Found problem_of(const SetDynamics& a) {
  return first_of({negative("damping", a.damping), negative("friction", a.friction)});
}

Found problem_of(const SetServo& a) {
  if (auto found = not_positive("stiffness", a.stiffness, "leave it out to keep the description's"))
    return found;
  for (const ServoField& field : servo_fields()) {
    if (auto found = negative(field.key, a.*field.value)) return found;
  }
  return {};
}

Found problem_of(const SetJointType& a) {
  static const std::vector<std::string> kTypes{"revolute", "continuous", "prismatic",
                                               "fixed",    "floating",   "planar"};
  if (std::ranges::find(kTypes, a.type) != kTypes.end()) return {};
  return InvalidValue{"type", fmt::format("'{}' is not a joint type{}", a.type, did_you_mean(a.type, kTypes)),
                      fmt::format("the types are {}", fmt::join(kTypes, ", "))};
}

Found problem_of(const SetInertia& a) {
  if (auto found = not_positive("mass", a.mass, "use 'remove_inertial' for a link without mass"))
    return found;
  for (const char* moment : {"ixx", "iyy", "izz"}) {
    const auto at = a.components.find(moment);
    if (at == a.components.end()) continue;
    if (auto found = negative(moment, at->second)) return found;
  }
  return {};
}

Found problem_of(const ComputeInertia& a) {
  constexpr const char* kLeaveOut = "omit it to keep the link's mass";
  return first_of({not_positive("mass", a.mass, kLeaveOut), not_positive("density", a.density, kLeaveOut)});
}

Found problem_of(const ScaleMasses& a) {
  auto found = not_positive("a total mass", a.total, "write the mass of the whole robot");
  if (found) found->key = "";
  return found;
}

Found problem_of(const AddMimic& a) {
  if (a.joint != a.leader) return {};
  return InvalidValue{"leader", fmt::format("'{}' cannot mimic itself", a.joint),
                      "choose another joint to mimic"};
}

Found problem_of(const SetMeshScale& a) {
  if (a.scale.cwiseAbs().minCoeff() > 0) return {};
  return InvalidValue{"scale", "a scale of 0 makes the mesh vanish",
                      "1 keeps its size, 0.001 converts millimetres to metres"};
}

Found problem_of(const Rename& a) {
  if (a.to.find_first_not_of(" \t\r\n") != std::string::npos) return {};
  return InvalidValue{"to", fmt::format("'{}' would have no name", a.from), "write its new name after 'to'"};
}

Found problem_of(const AddRos2Control& a) {
  if (a.plugin.empty())
    return InvalidValue{"plugin", "the block needs the class of its hardware plugin",
                        "for example mock_components/GenericSystem"};
  if (a.joints.empty())
    return InvalidValue{"joints", "the block drives no joint",
                        "write for example 'joints: [shoulder, elbow]'"};
  return {};
}

template <class Action>
Found problem_of(const Action& /*any values make sense*/) {
  return {};
}

}  // namespace

std::optional<InvalidValue> invalid_value_in(const OperationAction& action) {
  return std::visit([](const auto& a) { return problem_of(a); }, action);
}

}  // namespace doppel::overlay_detail
