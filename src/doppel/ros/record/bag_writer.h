#pragma once
// Writes a bag in rosbag2's shape: a folder NAME with MCAP files NAME_0.mcap, NAME_1.mcap, ... and
// metadata.yaml. Each file stands alone: latched messages are repeated at its start, and it has the
// metadata that rosbag2 writes. A file ends by its size, its time, or where log times are set back (a reset
// of the simulation), so that the times of a file ascend.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/base/mcap/mcap_file_sink.h"
#include "doppel/base/mcap/mcap_writer.h"
#include "doppel/export.h"
#include "doppel/ros/record/bag_metadata.h"

namespace doppel {

struct BagWriterOptions {
  std::filesystem::path folder;  // is made
  bool is_folder_made = false;   // by the caller, and empty
  // Instead of a folder: the one file of the bag, which is never split; `folder` names it. It outlives the
  // writer. There is no metadata.yaml.
  McapSink* sink = nullptr;
  McapWriterOptions file = {};
  std::uint64_t max_file_size = 0;  // bytes; 0: no limit
  Duration max_file_time{};         // of log times; 0: no limit
  std::string distro = "jazzy";
  std::map<std::string, std::string> custom = {};  // of metadata.yaml
};

struct RecordedTopic {
  std::string name, type, encoding = "cdr";
  std::string schema, schema_encoding = "ros2msg";
  std::string type_hash, qos;  // as in BagTopicCount
  std::size_t latched = 0;     // so many last messages are repeated at the start of each file
};

struct BagAttachment {
  std::string name, media_type;
  std::vector<std::byte> data;
};

class DOPPEL_API BagWriter {
 public:
  // Throws InputError "output.unwritable": the folder exists already, or cannot be made.
  explicit BagWriter(BagWriterOptions options);
  ~BagWriter();
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  // The functions below throw InputError "output.unwritable", for instance when the disk is full; what
  // was written before stays readable, and only close() may be called.

  // The number of the topic, for write(). A topic of the same name and type is the same; when it has more
  // latched messages than before, its qualities are those of this call.
  std::size_t add_topic(const RecordedTopic& topic);
  // Times in ns. `sequence`: of the topic's messages, from 1 on; 0: not counted.
  void write(std::size_t topic, std::uint32_t sequence, std::uint64_t log_time, std::uint64_t publish_time,
             McapBytes data);
  // Kept in the first file.
  void attach(const BagAttachment& attachment, std::uint64_t time);
  // In the present file.
  void add_metadata(const std::string& name, const std::vector<std::pair<std::string, std::string>>& texts);
  // Everything so far is in the file, and with sync() on the disk.
  void flush();
  void sync();
  // Begins what sync() does and does not wait for the disk; a failure is that of a later call.
  void start_sync();
  // The next message begins a new file.
  void split();
  // Removes the oldest file that is closed, and its entry in the metadata. The counts of messages stay.
  void remove_oldest();
  // Ends the file and writes metadata.yaml. A second call has no effect.
  void close();

  // Removes the folder with everything in it, for work that was ended.
  void discard();

  [[nodiscard]] const BagMetadata& metadata() const { return metadata_; }
  [[nodiscard]] std::uint64_t size() const;                    // bytes in all files that are there
  [[nodiscard]] std::uint64_t messages_in_files() const;       // after a failure fewer than were written
  [[nodiscard]] std::size_t latched(std::size_t topic) const;  // RecordedTopic::latched
  [[nodiscard]] const std::filesystem::path& folder() const { return options_.folder; }

 private:
  struct Topic;
  void open_file();
  void close_file();
  void begin_message(std::uint64_t log_time, std::size_t size);
  void repeat_latched(std::uint64_t log_time);
  void put(Topic& topic, std::uint32_t sequence, std::uint64_t log_time, std::uint64_t publish_time,
           McapBytes data);

  BagWriterOptions options_;
  BagMetadata metadata_;
  std::vector<Topic> topics_;
  std::unique_ptr<McapFileSink> sink_;  // nullptr: the next message opens a file
  std::unique_ptr<McapWriter> writer_;
  std::uint64_t last_time_ = 0;  // of the file
  std::uint64_t closed_size_ = 0;
  std::size_t opened_ = 0;  // files so far
  bool closed_ = false;
};

}  // namespace doppel
