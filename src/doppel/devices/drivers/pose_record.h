#pragma once
// The pose of an arm without encoders, which only a person can know: confirmed for one start of its board,
// or the pose in which it was parked. Kept in the user's state folder.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/export.h"

namespace doppel {

struct PoseRecord {
  std::uint32_t boot = 0;  // of the board; the pose of another start is not this one
  bool parked = false;     // the arm rests there also without power
  std::vector<std::pair<std::string, double>> positions;  // joints, rad
};

// Throws InputError with all errors: a joint of the setup is missing, unknown, or beyond its limits.
DOPPEL_API void check_pose(const ServoSetup& setup,
                           std::span<const std::pair<std::string, double>> positions);
// nullopt: none, or a file that cannot be read.
[[nodiscard]] DOPPEL_API std::optional<PoseRecord> read_pose_record(const std::filesystem::path& file);
// Throws InputError.
DOPPEL_API void write_pose_record(const std::filesystem::path& file, const PoseRecord& record);
// The file of a component, by the port of its board: two arms of one kind have two. Empty: the user has no
// state folder.
[[nodiscard]] DOPPEL_API std::filesystem::path pose_record_file(const std::string& component,
                                                                const std::string& port);

}  // namespace doppel
