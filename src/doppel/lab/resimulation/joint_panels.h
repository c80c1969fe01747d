#pragma once
// The joints of two recordings in one plot.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/lab/curve_plot/curve_plot.h"
#include "doppel/ros/record/bag_reader.h"

namespace doppel {

// A panel for each joint of a joint_states topic that both have, those with the largest differences first,
// `most` of them. Positions in rad or m over the times since the start of
// the first recording, and of each one where their times do not overlap.
[[nodiscard]] DOPPEL_API std::vector<PlotPanel> joint_panels(BagReader& first, const std::string& first_label,
                                                             BagReader& second,
                                                             const std::string& second_label,
                                                             std::size_t most);

}  // namespace doppel
