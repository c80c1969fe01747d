#pragma once
// Records the topics of a bus: an edge with a thread of its own, from whose ring nothing is lost unless the
// disk is slower for longer than the ring lasts. Losses are counted by the numbers of the messages. Without a
// thread the loop takes the messages itself, so that the same steps give the same bytes.

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
#include "doppel/ros/record/pending_latched.h"
#include "doppel/ros/record/recorder_services.h"
#include "doppel/ros/record/topic_selection.h"

namespace doppel {

struct RecorderOptions {
  BagWriterOptions bag;
  TopicSelection topics = {};
  std::vector<BagAttachment> attachments = {};
  std::vector<std::pair<std::string, std::vector<std::pair<std::string, std::string>>>> metadata = {};
  std::size_t ring_bytes = std::size_t{128} << 20;  // messages that wait for the disk
  // An observer within the process keeps the newest files only: as many as span `keep` of log times (0: all),
  // but no more than `keep_bytes` and kMaxKeptFiles. It is not part of the graph.
  Duration keep{};
  std::uint64_t keep_bytes = 0;
  bool on_loop = false;  // no thread: the loop calls take()
  bool listed = true;    // part of the graph, with the services of rosbag2's recorder
  int niceness = 0;      // of its thread
  // Called with each message on the recorder's thread. May be empty.
  std::function<void(const BagTopicCount& topic, const Edge::Incoming& message)> on_message = {};
  std::function<void()> on_look = {};      // the same every kLook, and before the end
  std::vector<std::string> unpaused = {};  // topics that are recorded during a pause, too
  // Called on the recorder's thread with the reason why the recording has ended early. Empty: the log gets
  // it.
  std::function<void(const std::string& why)> on_failure = {};
};
inline constexpr std::size_t kMaxKeptFiles = 100;  // each is open while they are copied

struct RecorderReport {
  std::uint64_t messages = 0;  // that can be read: after a failure those that are in the file
  std::uint64_t bytes = 0;
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
  // Records what was published so far. With `on_loop`, on the loop's thread.
  void take();
  [[nodiscard]] std::uint64_t size() const { return writer_.size(); }  // bytes so far; with `on_loop`

  // For a loop that is faster than the disk: waits while more than half of the ring is full. The loop's
  // thread.
  void let_catch_up() const;
  // Copies the last messages to another bag, on the recorder's thread: those of `last` before now, and the
  // latched ones. A bag that cannot be completed is removed. The functions are called there. Messages are
  // taken between two copies. Of those that wait at the end the urgent ones and one other are made. Once the
  // recording has ended, or while kMaxRequests wait, copy() itself calls `done` with the reason.
  struct Copy {
    Duration last{};
    std::function<std::unique_ptr<BagWriter>()> make_bag = {};
    // Attachments and metadata, before the messages; `time` in ns, for attachments.
    std::function<void(BagWriter&, std::uint64_t time)> add_parts = {};
    std::function<void(const std::string& failure)> done = {};  // with the reason, or ""
    // It is made before the others, and is not refused because of their number.
    bool is_urgent = false;
  };
  static constexpr std::size_t kMaxRequests = 32;  // of copy(), and of act()
  void copy(Copy request);
  // On the recorder's thread, after the messages so far: messages are left out until resume, which begins
  // with the last latched ones; the next message begins a new file; or the bag is closed, and nothing is
  // recorded any more. `done`: called there; false, at once: the recording has ended, or kMaxRequests wait.
  void act(RecorderAction action, std::function<void(bool)> done);
  [[nodiscard]] bool is_paused() const { return paused_.load(); }
  [[nodiscard]] std::uint64_t messages() const { return messages_.load(std::memory_order_relaxed); }
  [[nodiscard]] const std::filesystem::path& folder() const { return writer_.folder(); }

 private:
  struct Recorded {
    std::size_t topic = 0;       // of the writer
    std::uint32_t sequence = 0;  // of the last message
    std::int64_t stamp = 0;      // of the last message
    bool unpaused = false;
  };
  void run();
  void fail(const std::string& why);
  void subscribe();
  void count_publishers();
  void take_messages();
  void record(const Edge::Incoming& message);
  void close();
  void prune();
  enum class CopyKind { none, urgent, other };
  CopyKind serve_copy();  // of the copy that was made
  void make_copy(const Copy& request);
  struct Action {
    RecorderAction what;
    std::function<void(bool)> done;
  };
  void serve_actions();
  void refuse_requests(const std::string& why);
  [[nodiscard]] bool do_action(RecorderAction what);
  void pause(bool yes);
  void end();
  void offer_services();

  Bus& bus_;
  const Log& log_;
  RecorderOptions options_;
  BagWriter writer_;
  std::unique_ptr<Edge> edge_;
  std::uint64_t graph_ = 0;    // the version of the last look for topics
  std::uint64_t counted_ = 0;  // the version of the last count of publishers
  std::map<TopicId, Recorded> recorded_;
  std::int64_t time_ = 0;  // of the last message
  RecorderReport report_;
  PendingLatched latched_;     // of a pause
  std::mutex requests_mutex_;  // of the next three
  std::vector<Copy> copies_;
  std::vector<Action> actions_;
  std::optional<std::string> refusal_;  // why no request is served any more
  bool is_closed_ = false;              // of the recorder's thread, until it has ended, as is report_
  std::atomic<bool> ending_{false}, failed_{false}, paused_{false};
  std::optional<RecorderServices> services_;
  std::atomic<std::uint64_t> messages_{0};
  std::thread thread_;
};

// The description of a topic of the bus in a bag.
[[nodiscard]] DOPPEL_API RecordedTopic recorded_topic(const TopicInfo& topic);

}  // namespace doppel
