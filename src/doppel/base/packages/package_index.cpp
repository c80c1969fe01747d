#include "doppel/base/packages/package_index.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <deque>
#include <string_view>
#include <utility>

#include "doppel/base/packages/package_folder.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxDepth = 8;
constexpr std::size_t kMaxFolders = 4000;
constexpr int kLevelsWithoutWorkspace = 2;

bool is_left_out(const std::string& name) {
  constexpr std::array<std::string_view, 6> kNames{"build", "install",      "log",
                                                   "devel", "node_modules", "__pycache__"};
  return name.starts_with('.') || std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

// The content of a folder that is relevant to the crawl.
struct Content {
  std::vector<fs::path> folders;  // sorted
  bool package = false, ignored = false;
};

Content content_of(const fs::path& folder) {
  Content out;
  std::error_code none;
  for (fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, none), end;
       !none && entry != end; entry.increment(none)) {
    const std::string name = entry->path().filename().string();
    out.package = out.package || name == "package.xml";
    out.ignored = out.ignored || name == "COLCON_IGNORE" || name == "AMENT_IGNORE" || name == "CATKIN_IGNORE";
    // A symbolic link to a folder may lead anywhere, also back here.
    if (!is_left_out(name) && entry->is_directory(none) && !entry->is_symlink(none))
      out.folders.push_back(entry->path());
  }
  std::sort(out.folders.begin(), out.folders.end());
  return out;
}

bool may_be_crawled(const fs::path& folder) {
  const char* const home = std::getenv("HOME");
  return folder.has_relative_path() && folder.parent_path().has_relative_path() &&
         (home == nullptr || folder != fs::path(home).lexically_normal());
}

}  // namespace

PackageIndex crawl_packages(const fs::path& root) {
  PackageIndex out;
  std::deque<std::pair<fs::path, int>> queue{{root, 0}};
  for (std::size_t seen = 0; !queue.empty() && seen < kMaxFolders; ++seen) {
    const auto [folder, depth] = std::move(queue.front());
    queue.pop_front();
    Content content = content_of(folder);
    if (content.ignored) continue;
    out.folders.emplace(folder.filename().string(), folder);
    if (content.package) {
      out.packages.emplace(package_name(folder), folder);
      if (depth > 0) continue;
    }
    if (depth == kMaxDepth) continue;
    for (fs::path& below : content.folders) queue.emplace_back(std::move(below), depth + 1);
  }
  return out;
}

std::vector<fs::path> folders_to_crawl(const fs::path& context) {
  std::vector<fs::path> out;
  std::error_code none;
  fs::path outermost = context;
  for (fs::path at = context; may_be_crawled(at); at = at.parent_path()) {
    if (is_package(at)) outermost = at;
    if (at.filename() == "src" || fs::exists(at / ".git", none)) out.push_back(at);
    if (at.filename() == "src") break;
  }
  if (!out.empty()) return out;
  fs::path above = outermost;
  for (int level = 0; level < kLevelsWithoutWorkspace && may_be_crawled(above.parent_path()); ++level)
    above = above.parent_path();
  if (may_be_crawled(above)) out.push_back(above);
  return out;
}

}  // namespace doppel
