#pragma once
// Records what has been confirmed about one machine before it moves at full speed: that `doppel hardware
// check` passed, and that a person saw each joint turn the right way when it was nudged. Kept in the user's
// state folder.

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/export.h"

namespace doppel {

struct CheckRecord {
  std::string checked;  // the fingerprint of the setup; empty: not checked
  std::vector<std::pair<std::string, std::string>> nudged;  // joints, and their fingerprints then
};

// The servo of a joint as it is mounted and limited, or all of them, as a short text: another id,
// direction or offset is another machine, whose record counts no longer.
[[nodiscard]] DOPPEL_API std::string fingerprint(const JointServo& servo);
[[nodiscard]] DOPPEL_API std::string fingerprint(const ServoSetup& setup);

// The file of a component, by its port, which is named by its adapter (/dev/serial/by-id) where it has
// a name. Empty: the user has no state folder.
[[nodiscard]] DOPPEL_API std::filesystem::path check_record_file(const std::string& component,
                                                                 const std::string& port);
// An empty record: there is none, or a file that cannot be read.
[[nodiscard]] DOPPEL_API CheckRecord read_check_record(const std::filesystem::path& file);
// Throws InputError.
DOPPEL_API void write_check_record(const std::filesystem::path& file, const CheckRecord& record);

// A joint turned the right way; replaces what was recorded of it.
DOPPEL_API void add_nudged(CheckRecord& record, const JointServo& servo);
[[nodiscard]] DOPPEL_API bool is_checked(const CheckRecord& record, const ServoSetup& setup);
// The enabled joints that are not confirmed as they are now.
[[nodiscard]] DOPPEL_API std::vector<std::string> unconfirmed_joints(const CheckRecord& record,
                                                                     const ServoSetup& setup);

}  // namespace doppel
