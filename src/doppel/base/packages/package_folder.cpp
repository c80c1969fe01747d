#include "doppel/base/packages/package_folder.h"

#include <cctype>

#include "doppel/base/core/read_file.h"

namespace doppel {

namespace fs = std::filesystem;

bool is_package(const fs::path& folder) {
  std::error_code none;
  return fs::is_regular_file(folder / "package.xml", none);
}

std::string package_name(const fs::path& folder) {
  constexpr std::size_t kMaxManifestBytes = std::size_t{1} << 20;
  const std::string xml = read_content(folder / "package.xml", kMaxManifestBytes).bytes;
  const std::size_t open = xml.find("<name>");
  const std::size_t close = xml.find("</name>");
  if (open == std::string::npos || close == std::string::npos || close < open)
    return folder.filename().string();
  std::string name = xml.substr(open + 6, close - open - 6);
  std::erase_if(name, [](unsigned char c) { return std::isspace(c) != 0; });
  return name;
}

namespace {

fs::path around(const fs::path& file, const char* manifest) {
  std::error_code none;
  for (fs::path at = file.parent_path(); at.has_relative_path(); at = at.parent_path()) {
    if (fs::is_regular_file(at / manifest, none)) return at;
  }
  return {};
}

}  // namespace

fs::path package_around(const fs::path& file) {
  return around(file, "package.xml");
}

fs::path model_around(const fs::path& file) {
  return around(file, "model.config");
}

}  // namespace doppel
