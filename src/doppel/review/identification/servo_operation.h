#pragma once
// The overlay operation that a fit may write.

#include <optional>
#include <string>
#include <vector>

#include "doppel/description/overlay/operation.h"
#include "doppel/export.h"
#include "doppel/review/identification/servo_fit.h"

namespace doppel {

struct ServoWriting {
  std::optional<SetServo> operation;  // nothing: no value may be written
  std::string evidence;               // "rms 0.4 mrad, held out 0.4 mrad"
  std::vector<std::string> left_out;  // "effort is not written: ..."
};

// Values that are identified and trusted; with `accept` also those that are identified if the model fits.
// Values that are not identifiable are never written. The resolution and the rms of the residuals follow
// the values.
DOPPEL_API ServoWriting servo_operation(const std::string& joint, const ServoFit& fit, bool accept);

}  // namespace doppel
