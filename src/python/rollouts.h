#pragma once
// Many runs of one compiled world, each from a state of its own with commands of its own. A run depends on
// its inputs alone, so that the results are bit-identical at any number of threads.

#include <cstdint>
#include <span>

#include "doppel/physics/contract/engine.h"

namespace doppel::python {

struct RolloutInputs {
  const CompiledWorld* world = nullptr;
  int instance = 0;                  // of the robot
  std::span<const double> starts;    // [runs][nq + nv]
  std::span<const double> commands;  // [runs][rows][driven] rad, m, and NaN for none
  std::size_t runs = 0, rows = 0;
  std::uint64_t steps_per_row = 1;
  DriveMode mode = DriveMode::position;
};

// states: [runs][rows][nq + nv] after each row of commands; NaN from the row on in which a run diverges.
void roll_out(const RolloutInputs& inputs, std::size_t threads, std::span<double> states);

}  // namespace doppel::python
