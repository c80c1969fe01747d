#pragma once
// Shared by the readers of build files: paths as text.

#include <string>

namespace doppel::package_files {

inline std::string without_trailing_slash(std::string path) {
  while (path.size() > 1 && path.ends_with('/')) path.pop_back();
  return path;
}

inline std::string joined(const std::string& folder, const std::string& rest) {
  if (folder == ".") return rest;
  return rest.empty() ? folder : folder + "/" + rest;
}

}  // namespace doppel::package_files
