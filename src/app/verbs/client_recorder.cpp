#include "app/verbs/client_recorder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "app/print_stderr.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/shell.h"
#include "doppel/ros/messages/rosgraph_msgs.h"

namespace doppel::app {
namespace {

constexpr std::chrono::milliseconds kLook{100};   // for new topics
constexpr std::chrono::milliseconds kFlush{500};  // what a killed recorder loses at most
constexpr std::chrono::seconds kReport{1};
constexpr const char* kTimeTopic = "/clock";

// The protocol of a twin does not carry qualities, so that a topic is latched by its name there.
bool is_latched(const std::string& name, const Client::Topic& topic) {
  for (const Client::Endpoint& end : topic.publisher_ends) {
    for (const auto& [policy, value] : end.qos) {
      if (policy == "Durability") return value == "TRANSIENT_LOCAL";
    }
  }
  constexpr const char* kLatched[] = {"/tf_static", "/robot_description", "/robot_description_semantic",
                                      "/map",       "/doppel/scene",      "/doppel/sensors"};
  return std::ranges::any_of(kLatched, [&](const char* latched) { return name.ends_with(latched); });
}

Qos qos_of(const std::string& name, const Client::Topic& topic) {
  Qos out;
  out.latched = is_latched(name, topic);
  for (const Client::Endpoint& end : topic.publisher_ends) {
    for (const auto& [policy, value] : end.qos)
      out.best_effort = out.best_effort || (policy == "Reliability" && value == "BEST_EFFORT");
  }
  if (out.latched) out.depth = 1;
  return out;
}

RecordedTopic described(const std::string& name, const Client::Topic& topic) {
  RecordedTopic out;
  out.name = name;
  out.type = topic.type;
  const Qos qos = qos_of(name, topic);
  out.latched = qos.latched ? std::max<std::size_t>(1, topic.publishers.size()) : 0;
  out.qos = offered_qos_text({qos});
  out.schema = topic.schema;
  if (const TypeSupport* const type = find_type(topic.type)) {
    if (out.schema.empty()) out.schema = type->schema();
    out.type_hash = type->hash();
  }
  for (const Client::Endpoint& publisher : topic.publisher_ends) {
    if (!publisher.type_hash.empty()) out.type_hash = publisher.type_hash;
  }
  return out;
}

}  // namespace

ClientRecorder::ClientRecorder(Client& client, ClientRecorderOptions options)
    : client_(client), options_(std::move(options)), writer_(options_.bag), paused_(options_.paused) {}

void ClientRecorder::run() {
  const auto begin = Clock::now();
  const auto end = options_.duration > 0 ? begin + std::chrono::duration_cast<Clock::duration>(
                                                       std::chrono::duration<double>(options_.duration))
                                         : begin + kForever;
  auto flush = begin + kFlush, report = begin + kReport;
  while (Clock::now() < end && !stopped_) {
    if (options_.look) options_.look();
    subscribe();
    Client::Received message;
    if (client_.next(message, std::min(end, Clock::now() + kLook))) {
      if (options_.take) options_.take(message);
      record(message);
    }
    if (Clock::now() >= flush) {
      writer_.sync();
      flush = Clock::now() + kFlush;
    }
    if (Clock::now() >= report) {
      show(Clock::now() - begin);
      report = Clock::now() + kReport;
    }
  }
}

bool ClientRecorder::is_recorded(const std::string& name, const Client::Topic& topic) const {
  return !topic.type.empty() && (options_.include_unpublished || !topic.publishers.empty()) &&
         (!options_.ignore_leaf || !topic.subscribers.empty()) && options_.topics.selects(name, topic.type);
}

void ClientRecorder::subscribe() {
  if (!options_.discovers && has_looked_) return;
  has_looked_ = true;
  for (const auto& [name, topic] : client_.topics()) {
    if (recorded_.contains(name) || !is_recorded(name, topic)) continue;
    recorded_[name] = writer_.add_topic(described(name, topic));
    client_.subscribe(name);
  }
}

// nullopt: simulated time is not known yet.
std::optional<std::int64_t> ClientRecorder::stamp_of(const Client::Received& message) {
  if (!options_.sim_time) return std::max<std::int64_t>(0, nanoseconds_of(message.stamp));
  rosgraph_msgs::msg::Clock clock;
  if (message.topic == kTimeTopic && from_cdr(message.cdr, clock))
    clock_ = std::max<std::int64_t>(0, nanoseconds_of(from_msg(clock.clock)));
  return clock_;
}

void ClientRecorder::record(const Client::Received& message) {
  const std::optional<std::int64_t> stamp = stamp_of(message);
  const auto found = recorded_.find(message.topic);
  if (found == recorded_.end()) return;
  // A latched message is older than what came before it; a reset of the simulation is told apart by its
  // size.
  constexpr std::int64_t kSetBack = 1'000'000'000;
  const bool is_reset = message.topic == kTimeTopic && stamp && *stamp + kSetBack < time_;
  if (stamp) time_ = is_reset ? *stamp : std::max(time_, *stamp);
  const auto time = static_cast<std::uint64_t>(time_),
             own_time = static_cast<std::uint64_t>(stamp.value_or(0));
  if (paused_ || !stamp) {
    latched_.keep(found->second, writer_.latched(found->second), 0, own_time, message.cdr);
  } else if (options_.snapshot_mode) {
    wait({found->second, time, own_time, message.cdr});
  } else {
    latched_.write(writer_, time);
    writer_.write(found->second, 0, time, own_time, message.cdr);
  }
}

// The oldest ones give way.
void ClientRecorder::wait(Waiting message) {
  waiting_bytes_ += message.data.size();
  waiting_.push_back(std::move(message));
  while (waiting_bytes_ > options_.snapshot_bytes && !waiting_.empty()) {
    const Waiting& oldest = waiting_.front();
    latched_.keep(oldest.topic, writer_.latched(oldest.topic), 0, oldest.stamp, oldest.data);
    waiting_bytes_ -= oldest.data.size();
    waiting_.pop_front();
  }
}

void ClientRecorder::write_waiting() {
  if (!waiting_.empty()) latched_.write(writer_, waiting_.front().time);
  for (const Waiting& message : waiting_)
    writer_.write(message.topic, 0, message.time, message.stamp, message.data);
  waiting_.clear();
  waiting_bytes_ = 0;
  writer_.sync();
}

void ClientRecorder::act(RecorderAction action) {
  switch (action) {
    case RecorderAction::pause:
      paused_ = true;
      break;
    case RecorderAction::resume:
      paused_ = false;
      break;
    case RecorderAction::toggle_paused:
      paused_ = !paused_;
      break;
    case RecorderAction::split:
      writer_.split();
      break;
    case RecorderAction::snapshot:
      write_waiting();
      break;
    case RecorderAction::stop:
      stopped_ = true;
      break;
  }
}

void ClientRecorder::show(Clock::duration since) const {
  if (isatty(STDERR_FILENO) == 0) return;
  print_stderr("\r{:.0f} s, {} topics, {} messages, {}{}   ", std::chrono::duration<double>(since).count(),
               recorded_.size(), writer_.metadata().messages, size_text(writer_.size()),
               paused_ ? ", paused" : "");
}

}  // namespace doppel::app
