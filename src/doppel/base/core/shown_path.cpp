#include "doppel/base/core/shown_path.h"

namespace doppel {

std::string shown_path(const std::filesystem::path& file, const std::filesystem::path& folder) {
  if (file.empty() || !folder.has_relative_path()) return file.string();
  std::error_code none;
  const std::filesystem::path relative = std::filesystem::absolute(file, none).lexically_relative(folder);
  const bool below = !relative.empty() && *relative.begin() != "..";
  return below ? relative.lexically_normal().string() : file.string();
}

std::string shown_path(const std::filesystem::path& file) {
  std::error_code none;
  return shown_path(file, std::filesystem::current_path(none));
}

}  // namespace doppel
