#pragma once
// Reads a bag: one MCAP file, or a folder of them, as one sequence of messages.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "doppel/base/mcap/mcap_reader.h"
#include "doppel/export.h"
#include "doppel/ros/record/topic_selection.h"

namespace doppel {

// The MCAP files of a bag: the file itself; those that the folder's metadata.yaml lists and that exist; or
// else all of the folder, bag_9.mcap before bag_10.mcap. Throws InputError "bag.no_files", or that of
// files_of_bag_metadata().
[[nodiscard]] DOPPEL_API std::vector<std::string> files_of_bag(const std::string& bag);

struct BagTopic {
  std::string name, type, encoding;     // encoding: of the messages, "cdr"
  std::string schema, schema_encoding;  // "ros2msg"
  // The texts that rosbag2 writes; empty: not known. The qualities are those of the channel with the most
  // latched messages, as a publisher may have joined later.
  std::string qos, type_hash;
  std::size_t latched = 0;  // by the qualities, see BagReader::latched()
  std::uint64_t messages = 0;
  bool counted = true;  // false: a file does not say
};

struct BagPart {  // an attachment or metadata
  std::size_t file = 0;
  McapNamedPart part;
};

struct BagContents {
  std::vector<std::string> files;
  std::vector<BagTopic> topics;  // by their names
  std::vector<BagPart> attachments, metadata;
  std::uint64_t messages = 0, start = 0, end = 0, size = 0;  // ns, ns, bytes
  std::string profile, library;
  std::set<std::string> compressions;
  std::vector<std::string> notes;    // about files that were not closed or are damaged, with what to do
  std::vector<std::string> missing;  // files that metadata.yaml lists and that are not there
};

struct BagMessage {
  std::size_t topic = 0;  // of BagContents::topics
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0, publish_time = 0;  // ns
  McapBytes data;                                // valid until the next call
};

class DOPPEL_API BagReader {
 public:
  // Throws what files_of_bag() and McapReader throw, with the file's name.
  explicit BagReader(const std::string& bag);
  ~BagReader();
  BagReader(BagReader&&) noexcept;

  [[nodiscard]] const BagContents& contents() const;
  // How many last messages of a topic those get who come later: the sum over its publishers that are
  // transient local.
  [[nodiscard]] std::size_t latched(std::size_t topic) const;

  // Messages with log times in [start, end) of the selected topics, file after file, by log time within each.
  // Latched messages that doppel's recorder has repeated at the start of a file come once.
  void seek(std::uint64_t start, std::uint64_t end, const TopicSelection& topics);
  [[nodiscard]] std::optional<BagMessage> next();

  // The bytes of an attachment, or the texts of metadata.
  [[nodiscard]] std::vector<std::byte> attachment(const BagPart& part);
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> metadata(const BagPart& part);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
