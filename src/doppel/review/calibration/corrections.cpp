#include "doppel/review/calibration/corrections.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/units.h"

namespace doppel {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2;

bool is_far_enough(const Joint& joint, double a, double b) {
  try {
    const std::array<Measurement, 2> poses{Measurement{a, a}, Measurement{b, b}};
    check_spread(joint, poses);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

JointCorrection correct_joint(const Joint& joint, std::span<const Measurement> measurements,
                              LimitChoice limits) {
  JointCorrection out;
  out.fit = fit_joint(joint, measurements);
  out.operations = calibration_operations(joint, out.fit, measurements, limits);
  return out;
}

std::vector<std::string> doubts_about(const Joint& joint, const JointFit& fit,
                                      std::span<const Measurement> measurements) {
  std::vector<std::string> out;
  if (std::abs(fit.scale - 1.0) > kScaleTolerance)
    out.push_back(
        fmt::format("a scale cannot be expressed in the description; set {:.6g} in the driver, or check the "
                    "gear ratio, the pulse range and the servo horn",
                    fit.scale));
  if (fit.unwrapped.empty()) return out;
  const double unit = joint.type == JointType::prismatic ? 1e-3 : kDegree;
  std::string pairs;
  for (std::size_t i = 0; i < fit.unwrapped.size(); ++i)
    pairs += fmt::format(" {:.6g}={:.6g}", measurements[i].model / unit, fit.unwrapped[i] / unit);
  out.push_back("does the machine count from 0 to 360 degrees? The scale would be 1 with" + pairs);
  return out;
}

std::optional<std::array<double, 2>> suggested_poses(const Joint& joint) {
  const bool limited = joint.limits && joint.limits->has_position && joint.type != JointType::continuous;
  if (!limited) return std::array<double, 2>{0.0, kRightAngle};
  const double lower = joint.limits->lower, upper = joint.limits->upper;
  if (joint.type != JointType::prismatic && lower <= 0 && upper >= 0) {
    const double side = upper >= -lower ? std::min(upper, kRightAngle) : std::max(lower, -kRightAngle);
    if (is_far_enough(joint, 0, side)) return std::array<double, 2>{0.0, side};
  }
  if (!is_far_enough(joint, lower, upper)) return {};
  return std::array<double, 2>{lower, upper};
}

void refuse_repetition(const std::string& joint, const std::vector<Operation>& operations,
                       const std::vector<AppliedOverlay>& overlays, const std::string& target) {
  for (const AppliedOverlay& applied : overlays) {
    const auto i = correction_made_of(applied.overlay.operations, joint, operations);
    if (!i) continue;
    const Operation& old = applied.overlay.operations[*i];
    throw InputError(
        "calibrate.twice", old.where,
        fmt::format("'{}': the overlay already contains this correction ({}: {}); the measurements were "
                    "taken with the uncorrected model and would be applied twice",
                    joint, *i + 1, describe(old.action)),
        fmt::format("measure again with the corrected model, or remove the correction first (doppel "
                    "overlay remove {} {})",
                    applied.included ? applied.description.string() : target, *i + 1));
  }
}

void apply_in_order(std::span<Operation> operations, ExpandedDescription& description,
                    const PackageResolver& resolver) {
  for (Operation& operation : operations) {
    take_fingerprint(operation, description);
    Overlay one;
    one.operations = {operation};
    Diagnostics ignored;
    apply_overlay(one, description, resolver, ignored);
  }
}

}  // namespace doppel
