#pragma once
// Files that stand beside a description and that nobody asked for: CMakeLists.txt, launch files, YAML. They
// may be huge, pipes or devices, and their folders may be full; all that is read of them is bounded.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

inline constexpr std::size_t kMaxSideFileBytes = std::size_t{1} << 20;  // bytes
inline constexpr std::size_t kMaxSideEntries = 4096;                    // looked at in one folder
inline constexpr std::size_t kMaxSideFiles = 64;                        // read of one folder

struct DOPPEL_API SideFile {
  std::filesystem::path path;
  std::string text;
  std::vector<std::size_t> line_starts;

  [[nodiscard]] SourceLocation place(std::size_t at) const;
};

// Throws InputError "audit.skipped": not a regular file, unreadable, or larger than kMaxSideFileBytes.
DOPPEL_API SideFile read_side_file(const std::filesystem::path& file);

// The names in a folder, sorted, links to folders not followed; nothing for a folder that cannot be read.
struct SideFolder {
  std::vector<std::filesystem::path> entries;
  bool complete = true;  // false: there are more than kMaxSideEntries
};
DOPPEL_API SideFolder list_side_folder(const std::filesystem::path& folder);

// Those with one of these extensions (".py"), `most` at most. What is left out of a full folder becomes a
// note.
DOPPEL_API std::vector<std::filesystem::path> side_files_of(const std::filesystem::path& folder,
                                                            const std::vector<std::string>& extensions,
                                                            Diagnostics& skipped,
                                                            std::size_t most = kMaxSideFiles);

}  // namespace doppel
