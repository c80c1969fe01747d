#include "doppel/scenario/launch/detail/installed_view.h"

#include <cctype>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/read_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxRules = 100;  // each makes links to all files of its folders

struct Installed {
  fs::path source;       // below the package
  fs::path destination;  // below the share folder
};

// A path of a package's own files that stays below the folder that it is relative to.
bool stays_below(const fs::path& path) {
  const fs::path normal = path.lexically_normal();
  return !normal.is_absolute() && !normal.empty() && *normal.begin() != "..";
}

// A name that is one part of a path.
bool is_plain(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && name.find('/') == std::string::npos;
}

std::string without_comments(const std::string& text) {
  std::string out;
  bool comment = false;
  for (const char c : text) {
    comment = c == '#' || (comment && c != '\n');
    if (!comment) out += c;
  }
  return out;
}

// The words of a command of CMake, without quotes.
std::vector<std::string> words_in(const std::string& text) {
  std::vector<std::string> out;
  std::string word;
  for (const char c : text + " ") {
    if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      if (c != '"') word += c;
    } else if (!word.empty()) {
      out.push_back(std::exchange(word, {}));
    }
  }
  return out;
}

// The folder below share/NAME; "-": it is elsewhere.
std::string below_share(std::string destination, const std::string& name) {
  for (const std::string_view variable : {"${PROJECT_NAME}", "${CATKIN_PACKAGE_NAME}"}) {
    if (const std::size_t i = destination.find(variable); i != std::string::npos)
      destination.replace(i, variable.size(), name);
  }
  constexpr std::string_view kCatkin = "${CATKIN_PACKAGE_SHARE_DESTINATION}";
  if (destination.starts_with(kCatkin)) return destination.substr(kCatkin.size());
  const std::string share = "share/" + name;
  return destination.starts_with(share) ? destination.substr(share.size()) : "-";
}

void add_rule(const std::vector<std::string>& words, const std::string& name, std::vector<Installed>& out) {
  if (words.empty() || words[0] != "DIRECTORY") return;
  std::vector<std::string> sources;
  std::size_t i = 1;
  while (i < words.size() && words[i] != "DESTINATION") sources.push_back(words[i++]);
  if (i + 1 >= words.size()) return;
  const std::string below = below_share(words[i + 1], name);
  if (below == "-") return;
  const fs::path base = fs::path(below).relative_path();
  for (const std::string& source : sources) {
    // With a slash at its end the content is installed, without one the folder.
    const fs::path path = fs::path(source).lexically_normal();
    const fs::path destination = (source.ends_with('/') ? base : base / path.filename()).lexically_normal();
    if (source.find("${") != std::string::npos || !stays_below(path)) continue;
    if (!destination.empty() && !stays_below(destination)) continue;
    out.push_back({path, destination});
  }
}

std::vector<Installed> rules_of(const fs::path& package, const std::string& name) {
  constexpr std::string_view kCommand = "install(";
  const std::string text = without_comments(read_content(package / "CMakeLists.txt", kMaxBytes).bytes);
  std::vector<Installed> out;
  for (std::size_t command = text.find(kCommand); command != std::string::npos && out.size() < kMaxRules;) {
    const std::size_t begin = command + kCommand.size();
    const std::size_t end = text.find(')', begin);
    if (end == std::string::npos) break;
    add_rule(words_in(text.substr(begin, end - begin)), name, out);
    command = text.find(kCommand, end);
  }
  return out;
}

bool moves(const Installed& rule) {
  return rule.source.lexically_normal() != rule.destination.lexically_normal();
}

// A folder below `view`; false: a part of its path is a link, behind which are files of others.
bool make_folder(const fs::path& view, const fs::path& below) {
  std::error_code none;
  fs::create_directories(view, none);
  fs::path path = view;
  for (const fs::path& part : below) {
    path /= part;
    if (fs::is_symlink(fs::symlink_status(path, none))) return false;
    fs::create_directory(path, none);
  }
  return true;
}

// Links to the content of a folder, in a folder that may have links to others.
void link_content(const fs::path& source, const fs::path& destination) {
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(source, none)) {
    const fs::path link = destination / entry.path().filename();
    if (!fs::exists(fs::symlink_status(link, none)))
      fs::create_symlink(fs::absolute(entry.path()), link, none);
    else if (entry.is_directory(none) && fs::is_directory(link, none) && !fs::is_symlink(link, none))
      link_content(entry.path(), link);
  }
}

}  // namespace

fs::path installed_view(const fs::path& package, const std::string& name, const fs::path& folder) {
  if (!is_plain(name)) return {};
  std::error_code none;
  const std::vector<Installed> rules = rules_of(package, name);
  bool other_layout = false;
  for (const Installed& rule : rules)
    other_layout = other_layout || (moves(rule) && fs::is_directory(package / rule.source, none));
  if (!other_layout) return {};
  const fs::path view = folder / "share" / name;
  for (const Installed& rule : rules) {
    if (fs::is_directory(package / rule.source, none) && make_folder(view, rule.destination))
      link_content(package / rule.source, view / rule.destination);
  }
  if (make_folder(view, {})) link_content(package, view);
  return view;
}

}  // namespace doppel
