#pragma once
// The corrections that follow from the measurements of a joint, up to the overlay of its description.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "doppel/description/overlay/overlay.h"
#include "doppel/export.h"
#include "doppel/review/calibration/calibration.h"

namespace doppel {

struct JointCorrection {
  JointFit fit;
  std::vector<Operation> operations;  // without fingerprints
};

// Throws InputError as fit_joint().
DOPPEL_API JointCorrection correct_joint(const Joint& joint, std::span<const Measurement> measurements,
                                         LimitChoice limits);
// The doubts about a fit, in sentences: values that the description cannot express, and others.
DOPPEL_API std::vector<std::string> doubts_about(const Joint& joint, const JointFit& fit,
                                                 std::span<const Measurement> measurements);

// Two poses of the model that can be measured: the zero and a right angle, which a set square shows, or the
// limits, where these are not far enough apart. nullopt: its range is too small.
DOPPEL_API std::optional<std::array<double, 2>> suggested_poses(const Joint& joint);

// A measurement of the uncorrected model must not be applied again to the corrected one. `operations`: of
// `joint`, from new measurements. `target`: of the description, for the fix. Throws InputError.
DOPPEL_API void refuse_repetition(const std::string& joint, const std::vector<Operation>& operations,
                                  const std::vector<AppliedOverlay>& overlays, const std::string& target);

// Sets the fingerprint of each operation from the tree after the previous ones, and applies it to the tree.
// Throws InputError.
DOPPEL_API void apply_in_order(std::span<Operation> operations, ExpandedDescription& description,
                               const PackageResolver& resolver);

}  // namespace doppel
