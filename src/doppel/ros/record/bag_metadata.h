#pragma once
// metadata.yaml of a bag of rosbag2, and the qualities of service as it writes them. Source:
// rosbag2_storage of Jazzy, version 9 of the file.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

inline constexpr const char* kBagMetadataFile = "metadata.yaml";

struct BagTopicCount {
  std::string name, type, encoding = "cdr";
  std::string qos;        // offered_qos_text(); empty: not known
  std::string type_hash;  // "RIHS01_...", or empty
  std::uint64_t messages = 0;
};
struct BagFileCount {
  std::string path;                                     // relative to the bag's folder
  std::uint64_t start = 0, duration = 0, messages = 0;  // ns
};
struct BagMetadata {
  std::uint64_t start = 0, duration = 0, messages = 0;  // ns
  std::vector<BagTopicCount> topics;
  std::vector<BagFileCount> files;
  std::map<std::string, std::string> custom;
  std::string distro;  // "jazzy"
};

// The text of metadata.yaml.
[[nodiscard]] DOPPEL_API std::string bag_metadata_text(const BagMetadata& metadata);

// The files that a metadata.yaml of any version lists, in their order. Throws InputError "bag.metadata"
// with the place: no YAML, no list of files, or files of another storage than MCAP ("sqlite3"), which
// cannot be read.
[[nodiscard]] DOPPEL_API std::vector<std::string> files_of_bag_metadata(const std::filesystem::path& file);

// The list of qualities that publishers offer, as YAML; "" for none.
[[nodiscard]] DOPPEL_API std::string offered_qos_text(const std::vector<Qos>& offered);

}  // namespace doppel
