#pragma once
// The packages below a folder, as `colcon list` finds them.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct PackageIndex {
  std::map<std::string, std::filesystem::path> packages;  // by the <name> of package.xml
  // Folders by their names, the shallowest of each name: for packages without a package.xml.
  std::map<std::string, std::filesystem::path> folders;
};

// Crawls breadth first. Leaves out folders inside a package, hidden folders, build, install, log, devel and
// node_modules, and folders with COLCON_IGNORE, AMENT_IGNORE or CATKIN_IGNORE. Bounded: at most 8 levels
// and the nearest 4000 folders. Of packages with the same name the first by path is used. Does not throw
// for unreadable folders.
DOPPEL_API PackageIndex crawl_packages(const std::filesystem::path& root);

// The folders to crawl around a file or folder, nearest first: its repository (.git) and the src/ of its
// workspace; if it is in neither, two levels above its outermost package. Never the root of the file system,
// a folder directly below it, or the user's home.
DOPPEL_API std::vector<std::filesystem::path> folders_to_crawl(const std::filesystem::path& context);

}  // namespace doppel
