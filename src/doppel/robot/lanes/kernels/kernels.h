#pragma once
// The functions of the table of kernels.

#include "doppel/robot/lanes/lane_kernels.h"

namespace doppel {

long search_lanes(const LaneSearch& search);
std::uint32_t clearance_in_8_lanes(const LaneClearance& query);
std::uint32_t clearance_in_16_lanes(const LaneClearance& query);

}  // namespace doppel
