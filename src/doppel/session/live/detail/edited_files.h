#pragma once
// The files that an edit has changed, for the journal of a run.

#include <filesystem>
#include <map>

#include "doppel/base/core/file_version.h"
#include "doppel/ros/messages/doppel_msgs.h"

namespace doppel {

using FileVersions = std::map<std::filesystem::path, FileVersion>;

// The content of each file of `present` whose version differs from that in `before`. Throws InputError
// kEditedMeanwhile: a file has another version now than in `present`, which is what the run continues with.
// Throws InputError "file.unreadable": a file is there and cannot be read.
inline constexpr const char* kEditedMeanwhile = "reload.edited_meanwhile";
[[nodiscard]] doppel_msgs::msg::EditedFiles edited_files(const FileVersions& before,
                                                         const FileVersions& present);

}  // namespace doppel
