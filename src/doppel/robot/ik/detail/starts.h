#pragma once
// Starting points of searches, spread evenly over the limits.

#include <vector>

#include "doppel/robot/lanes/chain.h"

namespace doppel {

// [count][variables] by the sequence of Halton 1960. A turning variable without limits covers one turn,
// another one 1 m to each side.
std::vector<double> halton_starts(const Chain& chain, int count);

// The range of a variable in halton_starts().
struct StartRange {
  double low = 0, high = 0;
};
StartRange start_range(const Chain& chain, int variable);

}  // namespace doppel
