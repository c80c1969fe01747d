#pragma once
// Paths that come out of somebody's files: a recording, a package, a world. They name places in a folder, and
// must not lead out of it.

#include <filesystem>
#include <optional>

#include "doppel/export.h"

namespace doppel {

// The way from `folder` to `path`, which is absolute or relative to `folder`, in normal form: "a/../../b"
// leads out, whatever exists on the disk. nullopt: `path` is not below `folder`. Links on the disk are not
// resolved.
[[nodiscard]] DOPPEL_API std::optional<std::filesystem::path> path_below(const std::filesystem::path& path,
                                                                         const std::filesystem::path& folder);

}  // namespace doppel
