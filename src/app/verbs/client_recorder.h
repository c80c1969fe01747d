#pragma once
// Records the topics of a client's graph as a bag, with the services of rosbag2's recorder.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "doppel/ros/client/client.h"
#include "doppel/ros/record/bag_writer.h"
#include "doppel/ros/record/pending_latched.h"
#include "doppel/ros/record/recorder_services.h"
#include "doppel/ros/record/topic_selection.h"

namespace doppel::app {

struct ClientRecorderOptions {
  BagWriterOptions bag;
  TopicSelection topics;
  double duration = 0;  // s; 0: until it is interrupted or stopped
  bool paused = false;
  bool include_unpublished = false, ignore_leaf = false, discovers = true;
  bool sim_time = false;            // times are those of /clock; nothing is written before its first message
  bool snapshot_mode = false;       // messages are written when snapshot() is called
  std::size_t snapshot_bytes = 0;   // of messages that wait for it
  std::function<void()> look = {};  // called about every 100 ms, and after each message
  std::function<void(const Client::Received&)> take = {};  // called with each message
};

class ClientRecorder {
 public:
  ClientRecorder(Client& client, ClientRecorderOptions options);

  void run();
  void act(RecorderAction action);
  void close() { writer_.close(); }
  [[nodiscard]] bool is_paused() const { return paused_; }
  [[nodiscard]] const BagWriter& writer() const { return writer_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Waiting {
    std::size_t topic = 0;
    std::uint64_t time = 0, stamp = 0;
    Bytes data;
  };
  void subscribe();
  [[nodiscard]] bool is_recorded(const std::string& name, const Client::Topic& topic) const;
  void record(const Client::Received& message);
  [[nodiscard]] std::optional<std::int64_t> stamp_of(const Client::Received& message);
  void wait(Waiting message);
  void write_waiting();
  void show(Clock::duration since) const;

  Client& client_;
  ClientRecorderOptions options_;
  BagWriter writer_;
  std::map<std::string, std::size_t> recorded_;  // the writer's topics
  bool has_looked_ = false, paused_ = false, stopped_ = false;
  PendingLatched latched_;  // of a pause, or older than what waits
  std::deque<Waiting> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::optional<std::int64_t> clock_;
  std::int64_t time_ = 0;
};

}  // namespace doppel::app
