#pragma once
// The lines that a person reads at the start of a twin: its robots, controllers, contacts, sensors.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel::app {

// To stderr. `verbose`: with the load and sag of every drive.
void print_twin_banner(Twin& twin, const std::string& engine, bool verbose);

// Notes about a robot that comes with doppel, such as the choice of its base, are printed if `verbose`.
void print_start_diagnostics(const Diagnostics& diagnostics, bool verbose);

}  // namespace doppel::app
