#include "doppel/base/core/path_below.h"

namespace doppel {

std::optional<std::filesystem::path> path_below(const std::filesystem::path& path,
                                                const std::filesystem::path& folder) {
  // The system reads a path until its first NUL, behind which a ".." would not count.
  if (path.native().find('\0') != std::string::npos) return std::nullopt;
  std::filesystem::path way =
      (folder / path).lexically_normal().lexically_relative(folder.lexically_normal());
  if (way.empty() || way.is_absolute() || *way.begin() == ".." || *way.begin() == ".") return std::nullopt;
  return way;
}

}  // namespace doppel
