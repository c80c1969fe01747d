#pragma once
// Records the topics of a bus: an edge with a thread of its own, from whose ring nothing is lost unless the
// disk is slower for longer than the ring lasts. Losses are counted by the numbers of the messages.

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/record/bag_writer.h"
#include "doppel/ros/record/topic_selection.h"

namespace doppel {

struct RecorderOptions {
  BagWriterOptions bag;
  TopicSelection topics = {};
  std::vector<BagAttachment> attachments = {};
  std::vector<std::pair<std::string, std::vector<std::pair<std::string, std::string>>>> metadata = {};
  std::size_t ring_bytes = std::size_t{64} << 20;  // messages that wait for the disk
  // An observer within the process keeps the newest files only, and is not part of the graph.
  std::size_t keep_files = 0;  // 0: all
  bool listed = true;
  int niceness = 0;  // of its thread
  // Called with each message on the recorder's thread. May be empty.
  std::function<void(const BagTopicCount& topic, const Edge::Incoming& message)> on_message = {};
  std::function<void()> on_look = {};  // the same every kLook, and before the end
};

struct RecorderReport {
  std::uint64_t messages = 0, bytes = 0;
  std::map<std::string, std::uint64_t> lost;  // messages by topic
  std::string failure;                        // why the recording has ended early; empty: it has not
};

class DOPPEL_API BusRecorder {
 public:
  // Makes the bag and subscribes: what is published afterwards is recorded. The loop's thread. Throws what
  // BagWriter throws. The bus and the log outlive it.
  BusRecorder(Bus& bus, RecorderOptions options, const Log& log);
  ~BusRecorder();  // as stop()
  BusRecorder(const BusRecorder&) = delete;
  BusRecorder& operator=(const BusRecorder&) = delete;

  // Writes what was published so far and closes the bag. A second call has no effect.
  const RecorderReport& stop();
  // For a loop that is faster than the disk: waits while more than half of the ring is full. The loop's
  // thread.
  void let_catch_up() const;
  // Copies the last messages to another bag, on the recorder's thread: those of `last` before now, and the
  // latched ones. `done` and `add_parts`: called there, `done` with the reason of a failure, or "".
  struct Copy {
    BagWriterOptions bag;
    Duration last{};
    // Attachments and metadata, before the messages; `time` in ns, for attachments.
    std::function<void(BagWriter&, std::uint64_t time)> add_parts = {};
    std::function<void(const std::string& failure)> done = {};
  };
  void copy(Copy request);
  [[nodiscard]] std::uint64_t messages() const { return messages_.load(std::memory_order_relaxed); }
  [[nodiscard]] const std::filesystem::path& folder() const { return writer_.folder(); }

 private:
  struct Recorded {
    std::size_t topic = 0;       // of the writer
    std::uint32_t sequence = 0;  // of the last message
    std::int64_t stamp = 0;      // of the last message
  };
  void run();
  void fail(const std::string& why);
  void subscribe();
  void take_messages();
  void record(const Edge::Incoming& message);
  void close();
  void prune();
  void serve_copies();
  void make_copy(const Copy& request);

  Bus& bus_;
  const Log& log_;
  RecorderOptions options_;
  BagWriter writer_;
  std::unique_ptr<Edge> edge_;
  std::uint64_t graph_ = 0;  // the version of the last look
  std::map<TopicId, Recorded> recorded_;
  std::int64_t time_ = 0;  // of the last message
  RecorderReport report_;
  std::mutex copies_mutex_;
  std::vector<Copy> copies_;
  std::atomic<bool> ending_{false}, failed_{false};
  std::atomic<std::uint64_t> messages_{0};
  std::thread thread_;
};

// The description of a topic of the bus in a bag.
[[nodiscard]] DOPPEL_API RecordedTopic recorded_topic(const TopicInfo& topic);

}  // namespace doppel
