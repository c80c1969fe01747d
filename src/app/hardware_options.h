#pragma once
// The options of `up` and `emulate` for devices: which drivers run, and what is behind them.

#include <cstdint>
#include <string>

#include "doppel/scenario/schema/scenario.h"

namespace CLI {
class App;
}

namespace doppel::app {

struct HardwareRunOptions {
  bool emulate = false;  // the drivers of devices, on emulated buses
  bool ports = false;    // of the verb `emulate`
  bool no_guard = false;
  std::string faults, hand = "none", trace;
  std::string protocol;  // of servos that every joint gets; empty: those of the description
  std::string mirror = "shadow";
  bool no_shadow = false;
};

// Call it with `ports` set for the verb `emulate`.
void add_hardware_options(CLI::App& verb, HardwareRunOptions& options);
// The scenario has its robots. Their descriptions get the argument that selects hardware, where emulated
// devices are asked for. `seed`: of faults with a share. Throws InputError.
void apply(const HardwareRunOptions& options, std::uint64_t seed, Scenario& scenario);

}  // namespace doppel::app
