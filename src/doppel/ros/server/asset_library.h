#pragma once
// The files that a client may fetch: those that the loaded robot's description and its world refer to, and,
// by their extensions, the textures, materials and meshes in the same folders, because a spawned object may
// have any mesh of the robot's packages. A request is only compared with this table and the folders in it;
// the target of a symbolic link or a ".." has to be inside the package (or the folder of the referring
// file) as well.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct Asset {
  std::string uri;             // as in /robot_description
  std::filesystem::path file;  // absolute
  std::filesystem::path root;  // the folder that must contain it; empty: it is outside of its package already
};

struct AssetTable {
  std::vector<Asset> assets;
  // For files that no description refers to, selected by their extensions: URI prefixes with their folders,
  // and the folders that must contain such a file.
  std::vector<std::pair<std::string, std::filesystem::path>> folders;
  std::vector<std::filesystem::path> roots;
  // Further such folders, without their subfolders.
  std::vector<std::filesystem::path> flat;
};

// A mesh that was found.
struct MeshFile {
  std::string uri;                   // as in the messages to clients
  std::filesystem::path file;        // absolute
  std::filesystem::path named_in{};  // absolute; empty: the description
  std::filesystem::path model{};     // absolute; the folder of Gazebo's model that contains it; empty: none
};

// The references of a description, and of the world around the robot, to files; cheap to copy.
struct RobotFiles {
  std::filesystem::path description;
  std::vector<MeshFile> meshes;
  std::vector<std::string> textures;  // URIs
};
// Reads the disk to find the roots of packages.
DOPPEL_API AssetTable make_asset_table(const RobotFiles& files);

// All functions may be called from any thread.
class DOPPEL_API AssetLibrary {
 public:
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;  // of one file

  // Replaces the offered files.
  void offer(RobotFiles files);

  struct Answer {
    std::shared_ptr<const std::vector<std::byte>> bytes;  // nullptr: refused, with the reason in `why`
    std::string why;
  };
  // Reads the disk. An unchanged file whose bytes are still in use is not read again.
  [[nodiscard]] Answer read(std::string_view uri);

 private:
  // Identifies the content of a file when it was read.
  struct Stamp {
    std::uint64_t inode = 0, size = 0;
    std::int64_t modified = 0;  // ns
    bool operator==(const Stamp&) const = default;
  };
  struct Held {
    Stamp stamp;
    std::weak_ptr<const std::vector<std::byte>> bytes;
  };

  std::shared_ptr<const AssetTable> table();
  // A file that no description refers to. Neither bytes nor `why`: it does not exist, or is not of
  // an allowed kind.
  Answer read_companion(const AssetTable& known, std::string_view uri, std::string_view decoded);
  Answer read_file(const std::filesystem::path& file, const std::vector<std::filesystem::path>& roots,
                   std::string_view uri);
  Answer read_open(int fd, const std::filesystem::path& file, std::string_view uri);

  std::mutex mutex_;
  RobotFiles files_;
  std::uint64_t offers_ = 0;
  std::shared_ptr<const AssetTable> table_;  // made from files_ when first needed
  std::map<std::filesystem::path, Held> held_;
};

}  // namespace doppel
