#include "doppel/ros/server/asset_library.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/path_below.h"
#include "doppel/base/core/text.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/ros/server/detail/header_text.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxUriLength = 4096;
constexpr std::array<std::string_view, 16> kCompanions{".png", ".jpg",  ".jpeg", ".bmp", ".gif", ".tga",
                                                       ".tif", ".tiff", ".webp", ".dds", ".mtl", ".stl",
                                                       ".obj", ".dae",  ".glb",  ".gltf"};

std::string ending_of(const fs::path& file) {
  return lowered(file.extension().string());
}

bool is_companion(const fs::path& file) {
  return std::ranges::find(kCompanions, ending_of(file)) != kCompanions.end();
}

// The buffers of a glTF have the extension .bin, like many other files: only in the folder of
// an offered glTF.
bool is_gltf_buffer(const fs::path& file, const AssetTable& known) {
  return ending_of(file) == ".bin" && std::ranges::any_of(known.assets, [&file](const Asset& asset) {
           return ending_of(asset.file) == ".gltf" && asset.file.parent_path() == file.parent_path();
         });
}

bool is_held(const fs::path& file, const AssetTable& known) {
  return std::ranges::any_of(known.roots,
                             [&file](const fs::path& root) { return path_below(file, root).has_value(); }) ||
         std::ranges::find(known.flat, file.parent_path()) != known.flat.end();
}

// `file` is resolved, without symbolic links. A package that is installed by links, as by `colcon build
// --symlink-install`, resolves to its sources: a folder with a package.xml of the same name is the same one.
bool may_be_in(const fs::path& file, const fs::path& root) {
  std::error_code failed;
  const fs::path folder = fs::canonical(root, failed);
  if (failed || root.empty()) return false;
  if (path_below(file, folder)) return true;
  const fs::path package = package_around(file);
  return !package.empty() && is_package(folder) && package_name(package) == package_name(folder);
}

AssetLibrary::Answer refuse(std::string_view uri, std::string_view why) {
  return {nullptr, fmt::format("cannot fetch '{:.256}': {}", uri, why)};
}

}  // namespace

void AssetLibrary::offer(RobotFiles files) {
  const std::lock_guard lock(mutex_);
  files_ = std::move(files);
  ++offers_;
  table_ = nullptr;
  std::erase_if(held_, [](const auto& entry) { return entry.second.bytes.expired(); });
}

// The table is made without the lock, because a reload calls offer() on the loop's thread, which must not
// wait for the disk.
std::shared_ptr<const AssetTable> AssetLibrary::table() {
  RobotFiles files;
  std::uint64_t offer = 0;
  {
    const std::lock_guard lock(mutex_);
    if (table_) return table_;
    files = files_;
    offer = offers_;
  }
  auto made = std::make_shared<const AssetTable>(make_asset_table(files));
  const std::lock_guard lock(mutex_);
  if (offer == offers_) table_ = made;
  return made;
}

AssetLibrary::Answer AssetLibrary::read(std::string_view uri) {
  if (uri.size() > kMaxUriLength || uri.find('\0') != std::string_view::npos)
    return refuse(uri, "this is not the URI of a file");
  const auto known = table();
  const std::string decoded = percent_decoded(uri);
  for (const std::string_view name : {uri, std::string_view(decoded)}) {
    const auto found = std::ranges::find(known->assets, name, &Asset::uri);
    if (found != known->assets.end()) return read_file(found->file, {found->root}, uri);
  }
  if (decoded.find('\0') == std::string::npos) {
    Answer companion = read_companion(*known, uri, decoded);
    if (companion.bytes != nullptr || !companion.why.empty()) return companion;
  }
  std::vector<std::string> names;
  for (const Asset& asset : known->assets) names.push_back(asset.uri);
  return refuse(uri,
                "the robot description does not refer to this file, and only referenced files are served" +
                    did_you_mean(std::string(uri.substr(0, 256)), names));
}

AssetLibrary::Answer AssetLibrary::read_companion(const AssetTable& known, std::string_view uri,
                                                  std::string_view decoded) {
  const auto may_be_had = [&known](const fs::path& file) {
    return is_companion(file) || is_gltf_buffer(file, known);
  };
  std::error_code none;
  for (const std::string_view name : {uri, decoded}) {
    for (const auto& [prefix, folder] : known.folders) {
      if (!name.starts_with(prefix) || (prefix.empty() && name.find("://") != std::string_view::npos))
        continue;
      const fs::path file = (folder / name.substr(prefix.size())).lexically_normal();
      // The name is checked before the disk is read, so that no answer reveals which other files exist.
      if (!may_be_had(file) || !is_held(file, known) || !fs::exists(file, none)) continue;
      if (!may_be_had(fs::canonical(file, none)))
        return refuse(uri, "it is a symbolic link to a file that is not a mesh, an image or a material");
      std::vector<fs::path> roots = known.roots;
      roots.insert(roots.end(), known.flat.begin(), known.flat.end());
      return read_file(file, roots, uri);
    }
  }
  return {};
}

AssetLibrary::Answer AssetLibrary::read_file(const fs::path& file, const std::vector<fs::path>& roots,
                                             std::string_view uri) {
  std::error_code failed;
  const fs::path real = fs::canonical(file, failed);
  if (failed) return refuse(uri, failed.message());
  if (std::ranges::none_of(roots, [&](const fs::path& root) { return may_be_in(real, root); })) {
    return refuse(uri,
                  "it is outside its package (or, without one, the description's folder), and other files "
                  "are not served");
  }
  // O_NONBLOCK does not wait for the other end of a pipe; O_NOFOLLOW rejects a link made after the check.
  const FileDescriptor opened(open(real.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (!opened.is_open()) return refuse(uri, std::strerror(errno));
  const fs::path now = fs::read_symlink(fmt::format("/proc/self/fd/{}", opened.get()), failed);
  if (failed || now != real) return refuse(uri, "it was moved while it was being opened; request it again");
  return read_open(opened.get(), real, uri);
}

AssetLibrary::Answer AssetLibrary::read_open(int fd, const fs::path& file, std::string_view uri) {
  struct stat facts {};
  if (fstat(fd, &facts) != 0) return refuse(uri, std::strerror(errno));
  if (!S_ISREG(facts.st_mode)) return refuse(uri, "it is not a regular file");
  if (static_cast<std::uint64_t>(facts.st_size) > kMaxBytes) {
    return refuse(uri,
                  fmt::format("it has {} MiB; the maximum is {} MiB", facts.st_size >> 20, kMaxBytes >> 20));
  }
  const Stamp stamp{
      .inode = facts.st_ino,
      .size = static_cast<std::uint64_t>(facts.st_size),
      .modified = std::int64_t{facts.st_mtim.tv_sec} * 1'000'000'000 + facts.st_mtim.tv_nsec,
  };
  {
    const std::lock_guard lock(mutex_);
    const auto held = held_.find(file);
    if (held != held_.end() && held->second.stamp == stamp) {
      if (auto bytes = held->second.bytes.lock()) return {std::move(bytes), ""};
    }
  }
  const auto bytes = std::make_shared<std::vector<std::byte>>(stamp.size);
  const ssize_t got = read_all(fd, *bytes);
  if (got < 0) return refuse(uri, std::strerror(errno));
  bytes->resize(static_cast<std::size_t>(got));
  const std::lock_guard lock(mutex_);
  held_[file] = {stamp, bytes};
  return {bytes, ""};
}

}  // namespace doppel
