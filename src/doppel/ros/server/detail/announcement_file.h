#pragma once
// The file with which a twin of this user announces itself.

#include <filesystem>
#include <optional>

#include "doppel/ros/server/announcement.h"

namespace doppel {

// nullopt: it is none.
std::optional<RunningTwin> read_announcement(const std::filesystem::path& file);

}  // namespace doppel
