#pragma once
// The confirmation of a pose by a person, for an arm whose servos report nothing.

#include <string>
#include <utility>
#include <vector>

#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/serial/byte_link.h"
#include "doppel/export.h"

namespace doppel {

// Throws InputError: the servos of the setup report their positions, or a joint of the pose (rad) is missing,
// unknown or beyond its limits.
DOPPEL_API void check_confirmation(const ServoSetup& setup,
                                   const std::vector<std::pair<std::string, double>>& positions);

// Records that the arm stands at these positions (rad) since the present start of its board. Throws
// InputError as check_confirmation(), and where the board does not answer or the record cannot be written.
DOPPEL_API void confirm_pose(ByteLink& link, const ServoSetup& setup,
                             const std::vector<std::pair<std::string, double>>& positions);

}  // namespace doppel
