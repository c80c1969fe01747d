// A measured zero that is written in two places: in the model, by the overlay, and in the driver.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "doppel/base/core/text.h"
#include "doppel/base/math/units.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kSameOffset = 1e-3;  // rad or m: both have the same measurement as their source

struct DriverOffset {
  const std::string* name;
  double value;  // rad or m
};

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, problem] = std::from_chars(text.data(), end, value);
  if (problem != std::errc() || stop != end) return std::nullopt;
  return value;
}

// A parameter of a joint such as servo_offset_deg, with the unit that its name ends with.
std::optional<DriverOffset> driver_offset(const HardwareJointDescription& joint) {
  for (const auto& [name, text] : joint.params) {
    const std::string low = lowered(name);
    if (low.find("offset") == std::string::npos) continue;
    const std::optional<double> value = number_in(text);
    if (!value || *value == 0) continue;
    const double unit = low.ends_with("_deg") || low.ends_with("degrees") ? kDegree
                        : low.ends_with("_mm")                            ? 1e-3
                                                                          : 1;
    return DriverOffset{&name, *value * unit};
  }
  return std::nullopt;
}

// The zero that the overlays write into the joint, of all operations together. Nothing: there is none.
std::optional<double> baked_zero(const std::vector<AppliedOverlay>& overlays, const std::string& joint) {
  std::optional<double> out;
  for (const AppliedOverlay& one : overlays) {
    for (std::size_t i = 0; i < one.overlay.operations.size(); ++i) {
      const auto* zero = std::get_if<BakeZero>(&one.overlay.operations[i].action);
      const OperationState state = one.outcomes[i].state;
      const bool effective = state == OperationState::applied || state == OperationState::already_there;
      if (zero != nullptr && effective && zero->joint == joint) out = out.value_or(0) + zero->offset;
    }
  }
  return out;
}

}  // namespace

void check_calibration(const AuditInput& in, Findings& out) {
  if (in.overlays == nullptr) return;
  for (const HardwareDescription& hardware : in.robot.hardware) {
    for (const HardwareJointDescription& driven : hardware.joints) {
      const Joint* joint = in.robot.find_joint(driven.name);
      const std::optional<DriverOffset> offset = driver_offset(driven);
      const std::optional<double> zero = baked_zero(*in.overlays, driven.name);
      if (joint == nullptr || !offset || !zero) continue;
      const bool same = std::abs(std::abs(offset->value) - std::abs(*zero)) < kSameOffset;
      const bool slides = joint->type == JointType::prismatic;
      const double unit = slides ? 1e-3 : kDegree;
      out.add(
          "ros2_control.offset_twice", same ? Severity::error : Severity::warning, subject(*joint),
          driven.source,
          fmt::format(
              "the parameter '{}' of '{}' adds {:.6g} {}, and the overlay writes a zero of {:.6g} {} into "
              "the model{}",
              *offset->name, hardware.name, offset->value / unit, slides ? "mm" : "deg", *zero / unit,
              slides ? "mm" : "deg", same ? ": the same measurement twice" : ""),
          same ? fmt::format("remove '{}', or the operation bake_zero of the overlay", *offset->name) : "");
    }
  }
}

}  // namespace doppel::audit_rules
