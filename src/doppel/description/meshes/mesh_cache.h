#pragma once
// Results that are computed from a mesh file and take long, in the user's cache folder
// ($XDG_CACHE_HOME/doppel, else ~/.cache/doppel): one small file for each mesh and kind of result, written
// completely or not at all, and used only with the expected kind, key and checksum. Any thread.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// The fingerprint of the file at `path`, absolute and normalised: path, size and time of change. Empty: there
// is no such file.
DOPPEL_API std::string mesh_fingerprint(const std::filesystem::path& path);

// `fingerprint` is that of the mesh before it was read; `kind` names the result, its version and what else it
// follows from. nullopt: it is not stored, or for another fingerprint, or damaged.
DOPPEL_API std::optional<std::string> cached_result(const std::string& fingerprint, std::string_view kind);
// Without a writable folder, or of more than kMaxCachedBytes, nothing is stored.
DOPPEL_API void cache_result(const std::string& fingerprint, std::string_view kind, std::string_view content);
inline constexpr std::size_t kMaxCachedBytes = 1 << 20;

// The bytes of such a file: kind, key and content, with a checksum.
DOPPEL_API std::string sealed_result(std::string_view kind, std::string_view key, std::string_view content);
DOPPEL_API std::optional<std::string> opened_result(std::string_view bytes, std::string_view kind,
                                                    std::string_view key);

}  // namespace doppel
