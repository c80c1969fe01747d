// A world by the name that the command line gives it, and the worlds that come with doppel.
#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "doppel/base/core/installation.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/text.h"
#include "doppel/scenario/sdf/detail/model_search.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxAboutBytes = 2000;  // the first comment is at the beginning of the file

bool is_world_file(const fs::path& file) {
  const std::string extension = lowered(file.extension().string());
  return extension == ".yaml" || extension == ".yml" || extension == ".sdf" || extension == ".world";
}

// The names of worlds and models in a folder; without their extension if `stems`.
void add_world_names(const fs::path& folder, bool stems, std::vector<std::string>& out) {
  std::error_code none;
  for (fs::directory_iterator it(folder, none), end; !none && it != end; it.increment(none)) {
    const fs::path& path = it->path();
    if (fs::exists(path / "model.config", none) || fs::exists(path / "model.sdf", none))
      out.push_back(path.filename().string());
    else if (is_world_file(path))
      out.push_back((stems ? path.stem() : path.filename()).string());
  }
}

// The files that a name may mean, in the order of their priority.
std::vector<std::string> files_named(const std::string& name, bool sdf_first) {
  if (sdf_first) return {name, name + ".sdf", name + ".world", name + ".yaml", name + ".yml"};
  return {name, name + ".yaml", name + ".yml", name + ".sdf", name + ".world"};
}

// "kate_lab", "kate_lab.sdf" and "worlds/kate_lab.sdf" are the same bundled world. Empty: there is none.
fs::path find_bundled_world(const fs::path& name, bool sdf_first) {
  if (name.has_parent_path() && name.parent_path() != "worlds") return {};
  fs::path by_stem;
  for (const BundledWorld& world : bundled_worlds()) {
    if (world.file.filename() == name.filename()) return world.file;
    if (world.file.stem() != name.filename()) continue;
    if (by_stem.empty() || is_sdf(world.file) == sdf_first) by_stem = world.file;
  }
  return by_stem;
}

std::string without_comment_signs(std::string line) {
  const std::size_t begin = line.find_first_not_of("#<!- \t");
  line.erase(0, std::min(begin, line.size()));
  if (const std::size_t end = line.find("-->"); end != std::string::npos) line.resize(end);
  while (!line.empty() && (line.back() == ' ' || line.back() == '\r')) line.pop_back();
  return line;
}

std::string first_sentence(const fs::path& file) {
  std::istringstream in(beginning_of_file(file, kMaxAboutBytes));
  std::string out, line;
  while (std::getline(in, line)) {
    if (line.starts_with("<?xml")) continue;
    const bool starts_comment = line.starts_with('#') || line.starts_with("<!--");
    if (out.empty() && !starts_comment) break;
    out += (out.empty() ? "" : " ") + without_comment_signs(line);
    if (out.find_first_of(".;") != std::string::npos || line.find("-->") != std::string::npos) break;
  }
  return out.substr(0, out.find_first_of(".;"));
}

[[noreturn]] void refuse_world(const std::string& name, const ModelSearch& search) {
  const fs::path given(name);
  std::error_code none;
  const fs::path beside = given.has_parent_path() ? given.parent_path() : fs::current_path(none);
  const bool stems = !given.has_extension();
  std::vector<std::string> known;
  add_world_names(beside, stems, known);
  for (const fs::path& root : search.roots()) {
    for (const fs::path& folder : {root, root / "worlds"}) add_world_names(folder, stems, known);
  }
  std::string bundled;
  for (const BundledWorld& world : bundled_worlds()) {
    known.push_back((stems ? world.file.stem() : world.file.filename()).string());
    bundled += (bundled.empty() ? "" : ", ") + world.file.filename().string();
  }
  const auto near = nearest_name(given.filename().string(), known);
  throw InputError(
      "world.not_found", {},
      fmt::format(
          "there is no world '{0}'{1}; searched: {0}, the folders of GZ_SIM_RESOURCE_PATH and of Gazebo's "
          "models, and the bundled worlds ({2})",
          name, near ? fmt::format("; did you mean '{}'?", *near) : "", bundled),
      "give a YAML or SDF file, a model's folder, or a name of 'doppel worlds'");
}

}  // namespace

fs::path find_world(const std::string& name, PackageResolver& resolver, bool sdf_first) {
  std::error_code none;
  if (fs::exists(name, none)) return name;
  ModelSearch search(fs::current_path(none) / "none.sdf", resolver);
  const auto find_file = [&](const std::string& named) {
    for (const std::string& candidate : files_named(named, sdf_first)) {
      const FoundFile& found = search.find(candidate, fs::current_path(none));
      if (!found.path.empty()) return found.path;
    }
    return fs::path();
  };
  if (fs::path found = find_file(name); !found.empty()) return found;
  if (fs::path bundled = find_bundled_world(name, sdf_first); !bundled.empty()) return bundled;
  if (fs::path found = find_file("worlds/" + name); !found.empty()) return found;
  refuse_world(name, search);
}

std::vector<BundledWorld> bundled_worlds() {
  std::vector<BundledWorld> out;
  std::error_code none;
  for (fs::directory_iterator it(data_folder() / "worlds", none), end; !none && it != end;
       it.increment(none)) {
    if (is_world_file(it->path())) out.push_back({it->path(), first_sentence(it->path())});
  }
  std::ranges::sort(out, {}, &BundledWorld::file);
  return out;
}

}  // namespace doppel
