#include "doppel/scenario/schema/detail/scenario_paths.h"

#include <string_view>

#include "doppel/base/core/installation.h"

namespace doppel::schema_detail {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBundled = "bundled:";

fs::path absolute_path(const fs::path& path) {
  std::error_code none;
  return fs::absolute(path, none).lexically_normal();
}

}  // namespace

std::string written_path(const fs::path& path, const fs::path& folder) {
  const fs::path absolute = absolute_path(path);
  const fs::path in_data = absolute.lexically_relative(absolute_path(data_folder()));
  if (!in_data.empty() && (*in_data.begin() == "robots" || *in_data.begin() == "worlds"))
    return std::string(kBundled) + in_data.generic_string();
  const fs::path relative = absolute.lexically_relative(absolute_path(folder));
  return (relative.empty() ? absolute : relative).generic_string();
}

std::string written_word(const std::string& word, const fs::path& folder) {
  std::error_code none;
  return fs::exists(word, none) ? written_path(word, folder) : word;
}

fs::path read_path(const std::string& written, const fs::path& folder) {
  if (written.starts_with(kBundled)) return data_folder() / written.substr(kBundled.size());
  return (folder / written).lexically_normal();
}

std::string read_word(const std::string& written, const fs::path& folder) {
  if (written.starts_with(kBundled)) return read_path(written, folder).string();
  std::error_code none;
  const fs::path beside = read_path(written, folder);
  return fs::exists(beside, none) ? beside.string() : written;
}

}  // namespace doppel::schema_detail
