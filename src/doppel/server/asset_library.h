#pragma once
// The files that a client may fetch: those that the loaded robot's description and its world name, and by
// their endings the textures, materials and meshes beside them: an object that a client puts in may have any
// mesh of the robot's packages. A request is only ever compared with this table and with the folders in it;
// what a link or a ".." leads to has to lie in the package (or the folder of what names it) as well.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct Asset {
  std::string uri;             // as it stands in /robot_description
  std::filesystem::path file;  // absolute
  std::filesystem::path root;  // the folder that it may not leave; empty: it has done so already
};

struct AssetTable {
  std::vector<Asset> assets;
  // For what no description names, known by its ending: what URIs that begin with the first mean (the second,
  // and what follows), and the folders that it may not leave.
  std::vector<std::pair<std::string, std::filesystem::path>> folders;
  std::vector<std::filesystem::path> roots;
  // And these, of which no folder inside counts.
  std::vector<std::filesystem::path> flat;
};

// A mesh that was found.
struct MeshFile {
  std::string uri;                   // as clients are notified of it
  std::filesystem::path file;        // absolute
  std::filesystem::path named_in{};  // absolute; empty: the description
};

// What of a description, and of the world around the robot, says which files are needed; cheap to take.
struct RobotFiles {
  std::filesystem::path description;
  std::vector<MeshFile> meshes;
  std::vector<std::string> textures;  // URIs
};
DOPPEL_API RobotFiles files_of(const RobotDescription& robot);
// Looks at the disk for where packages begin.
DOPPEL_API AssetTable make_asset_table(const RobotFiles& files);

// All functions may be called from any thread.
class DOPPEL_API AssetLibrary {
 public:
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;  // of one file

  // From now on these, and no others.
  void offer(RobotFiles files);

  struct Answer {
    std::shared_ptr<const std::vector<std::byte>> bytes;  // null: refused
    std::string why;
  };
  // Reads the disk. A file that somebody still holds the same bytes of is not read again.
  [[nodiscard]] Answer read(std::string_view uri);

 private:
  // Which bytes a file had when it was read.
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
  // Of a file that no description names; no bytes and no why: there is none, or it is of no kind to hand out.
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
