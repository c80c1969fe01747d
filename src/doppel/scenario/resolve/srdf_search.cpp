#include "doppel/scenario/resolve/srdf_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "doppel/scenario/resolve/side_files.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxGroups = 200;  // a humanoid with hands has 30; what checks nested ones is cubic
constexpr std::uintmax_t kMaxSrdfBytes = std::uintmax_t{4} << 20;  // 40,000 pairs of links

// The folders of a package in which MoveIt's setup assistant and manufacturers place SRDF files.
constexpr const char* kSrdfFolders[] = {"", "srdf", "config", "config/srdf", "config/moveit"};

// The folders inside this one with "moveit" in their names.
std::vector<fs::path> moveit_folders(const fs::path& folder) {
  std::vector<fs::path> out = list_side_folder(folder).entries;
  std::erase_if(out, [](const fs::path& entry) {
    return entry.filename().string().find("moveit") == std::string::npos;
  });
  return out;
}

std::vector<fs::path> folders_of(const Target& target) {
  std::vector<fs::path> packages, out{fs::absolute(target.description).lexically_normal().parent_path()};
  if (!target.package_folder.empty()) {
    packages.push_back(fs::absolute(target.package_folder / "").lexically_normal().parent_path());
    // Repositories of many robots have a folder of packages: moveit_cfgs/fanuc_m10ia_moveit_config.
    for (const fs::path& entry : moveit_folders(packages.front().parent_path())) {
      packages.push_back(entry);
      for (const fs::path& inner : moveit_folders(entry)) packages.push_back(inner);
    }
  }
  for (const fs::path& package : packages) {
    for (const char* folder : kSrdfFolders) {
      const fs::path path = *folder == 0 ? package : package / folder;
      if (path != out.front()) out.push_back(path);
    }
  }
  return out;
}

std::vector<fs::path> srdf_files(const fs::path& folder) {
  std::vector<fs::path> files = list_side_folder(folder).entries;
  std::erase_if(files, [](const fs::path& file) {
    const std::string name = file.filename().string();
    return !name.ends_with(".srdf") && !name.ends_with(".srdf.xacro");
  });
  files.resize(std::min(files.size(), kMaxSideFiles));
  return files;
}

SrdfDescription load_bounded(const fs::path& file, PackageResolver& resolver, Diagnostics& diagnostics) {
  std::error_code failed;
  if (const std::uintmax_t size = fs::file_size(file, failed); !failed && size > kMaxSrdfBytes)
    throw InputError("audit.skipped", make_location(file.string()), "the file is larger than 4 MB",
                     "nothing, if it is not needed; otherwise make it smaller");
  SrdfDescription srdf = load_srdf(file, resolver, diagnostics);
  if (srdf.groups.size() > kMaxGroups)
    throw InputError(
        "audit.skipped", srdf.source,
        fmt::format("the file has {} groups; at most {} are checked", srdf.groups.size(), kMaxGroups),
        "nothing, if it is not needed; otherwise remove groups");
  return srdf;
}

// The robots of one manufacturer share names: the file of a cell with two arms has that of one arm. At least
// half of the links and joints in the groups and states are the robot's.
bool belongs_to(const RobotDescription& robot, const SrdfDescription& srdf) {
  if (srdf.robot != robot.name) return false;
  int present = 0, missing = 0;
  const auto count = [&](bool found) { ++(found ? present : missing); };
  const auto count_link = [&](const std::string& name) { count(robot.find_link(name) != nullptr); };
  const auto count_joint = [&](const std::string& name) { count(robot.find_joint(name) != nullptr); };
  for (const SrdfGroup& group : srdf.groups) {
    for (const SrdfReference& link : group.links) count_link(link.name);
    for (const SrdfReference& joint : group.joints) count_joint(joint.name);
    for (const SrdfChain& chain : group.chains) {
      count_link(chain.base_link);
      count_link(chain.tip_link);
    }
  }
  for (const SrdfGroupState& state : srdf.states) {
    for (const SrdfJointValue& value : state.values) count_joint(value.joint);
  }
  return present >= missing;
}

}  // namespace

std::vector<FoundSrdf> find_srdf(const RobotDescription& robot, const Target& target,
                                 PackageResolver& resolver, Diagnostics& skipped) {
  std::vector<FoundSrdf> out;
  for (const fs::path& folder : folders_of(target)) {
    for (const fs::path& file : srdf_files(folder)) {
      try {
        FoundSrdf found{file, {}, {}};
        found.srdf = load_bounded(file, resolver, found.diagnostics);
        if (belongs_to(robot, found.srdf)) out.push_back(std::move(found));
      } catch (const InputError& error) {
        for (const Diagnostic& d : error.diagnostics()) skipped.note(d.rule, d.where, d.message, d.fix);
      }
    }
  }
  return out;
}

}  // namespace doppel
