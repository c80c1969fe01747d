#pragma once
// Files around a description that it does not refer to: CMakeLists.txt, launch files, YAML. They may be huge,
// pipes or devices, and their folders may have very many entries, so reading is bounded.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

inline constexpr std::size_t kMaxSideFileBytes = std::size_t{1} << 20;  // bytes
inline constexpr std::size_t kMaxSideEntries = 4096;                    // entries of one folder
inline constexpr std::size_t kMaxSideFiles = 64;                        // files read in one folder

struct DOPPEL_API SideFile {
  std::filesystem::path path;
  std::string text;
  std::vector<std::size_t> line_starts;

  [[nodiscard]] SourceLocation place(std::size_t at) const;
};

// Throws InputError "audit.skipped": not a regular file, unreadable, or larger than kMaxSideFileBytes.
DOPPEL_API SideFile read_side_file(const std::filesystem::path& file);

// The entries of a folder, sorted, without links to folders; empty for a folder that cannot be read.
struct SideFolder {
  std::vector<std::filesystem::path> entries;
  bool complete = true;  // false: there are more than kMaxSideEntries
};
DOPPEL_API SideFolder list_side_folder(const std::filesystem::path& folder);

// At most `most` files with one of these extensions (".py"). Omitted files are a note in `skipped`.
DOPPEL_API std::vector<std::filesystem::path> side_files_of(const std::filesystem::path& folder,
                                                            const std::vector<std::string>& extensions,
                                                            Diagnostics& skipped,
                                                            std::size_t most = kMaxSideFiles);

}  // namespace doppel
