#pragma once
// Rates of the checks that sample: inverse kinematics of T1 and configurations of T3, on one thread.

#include <string>
#include <vector>

namespace doppel::bench {

// A table for the targets: "NAME" of a bundled robot, or a file.
void print_rates(const std::vector<std::string>& targets);

}  // namespace doppel::bench
