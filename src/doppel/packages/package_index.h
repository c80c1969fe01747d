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
  // Folders by their own names, the shallowest of each: a package that lost its package.xml.
  std::map<std::string, std::filesystem::path> folders;
};

// Crawls breadth first. Leaves out what is inside a package, hidden folders, build, install, log, devel and
// node_modules, and folders with COLCON_IGNORE, AMENT_IGNORE or CATKIN_IGNORE. Bounded: at most 8 levels and
// 4000 folders, of which the nearest are seen. Of packages with one name the first by path counts.
DOPPEL_API PackageIndex crawl_packages(const std::filesystem::path& root);

// The folders to be crawled for what lies around a file or folder, nearest first: its repository (.git) and
// the src/ of its workspace; where it is in neither, two levels above its outermost package. Never the root
// of the file system, a folder directly below it, or the user's home.
DOPPEL_API std::vector<std::filesystem::path> folders_to_crawl(const std::filesystem::path& context);

}  // namespace doppel
