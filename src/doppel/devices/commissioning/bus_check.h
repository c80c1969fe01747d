#pragma once
// Differences between a bus and the needs of a description's driver: registers, ids, models, supplies.
// Registers are written only on request, and their former values are kept in a file.

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/export.h"

namespace doppel {

// A register that should have another value.
struct RegisterChange {
  std::string joint;
  int id = 0;
  const ServoRegister* which = nullptr;
  std::int64_t before = 0, after = 0;
  std::string why;
};

struct DOPPEL_API BusCheck {
  std::vector<Diagnostic> findings;     // errors: the driver would refuse; warnings; notes
  std::vector<RegisterChange> changes;  // what --fix writes
  [[nodiscard]] bool passed() const;
};

// Reads only.
[[nodiscard]] DOPPEL_API BusCheck check_bus(ServoBus& bus, const ServoSetup& setup);

// Writes the changes, with the torque of those servos off, and reads them back. Before the first one the
// former values are written to `backup`. Throws InputError: a servo has its torque on, the file cannot be
// written, a servo does not confirm.
DOPPEL_API void apply_changes(ServoBus& bus, const ServoSetup& setup,
                              const std::vector<RegisterChange>& changes,
                              const std::filesystem::path& backup);
// The changes back to the values of a backup. Throws InputError: not a backup, or one of other servos; a
// servo does not answer, so that nothing says which value it has.
[[nodiscard]] DOPPEL_API std::vector<RegisterChange> changes_back(ServoBus& bus, const ServoSetup& setup,
                                                                  const std::filesystem::path& backup);

}  // namespace doppel
