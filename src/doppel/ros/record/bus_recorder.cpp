#include "doppel/ros/record/bus_recorder.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/thrown.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/record/bag_copy.h"
#include "doppel/ros/record/bag_reader.h"

namespace doppel {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kOrigin = "record";
// Between two looks for messages, new topics and the end. The thread sleeps instead of being woken, because
// waking it would cost the loop a system call for each message; the ring has room for far longer.
constexpr std::chrono::milliseconds kLook{5};
// A killed process or a loss of power costs at most so much.
constexpr std::chrono::milliseconds kFlush{500};

}  // namespace

RecordedTopic recorded_topic(const TopicInfo& topic) {
  RecordedTopic out;
  out.name = topic.name;
  out.type = topic.type;
  // The bus keeps one message for each latched publisher.
  const auto keepers = std::ranges::count_if(
      topic.publishers, [](const EndpointInfo& publisher) { return publisher.qos.latched; });
  out.latched = std::max(topic.latched ? std::size_t{1} : std::size_t{0}, static_cast<std::size_t>(keepers));
  std::vector<Qos> offered;
  for (const EndpointInfo& publisher : topic.publishers) offered.push_back(publisher.qos);
  out.qos = offered_qos_text(offered);
  if (const TypeSupport* const type = find_type(topic.type)) {
    out.schema = type->schema();
    out.type_hash = type->hash();
  }
  return out;
}

BusRecorder::BusRecorder(Bus& bus, RecorderOptions options, const Log& log)
    : bus_(bus),
      log_(log),
      options_(std::move(options)),
      writer_(options_.bag),
      edge_(bus.attach(kRecorderNode, {.ring_bytes = options_.ring_bytes, .listed = options_.listed})) {
  try {
    for (const BagAttachment& attachment : options_.attachments)
      writer_.attach(attachment, static_cast<std::uint64_t>(nanoseconds_of(bus.ros_now())));
    for (const auto& [name, texts] : options_.metadata) writer_.add_metadata(name, texts);
    writer_.sync();
  } catch (...) {
    writer_.discard();
    throw;
  }
  options_.attachments.clear();
  subscribe();
  if (options_.listed) offer_services();
  // What is latched was published before; the recording begins now.
  if (options_.on_loop) time_ = std::max<std::int64_t>(0, nanoseconds_of(bus.ros_now()));
  bus.spin();  // so that no request of another edge comes before the subscriptions
  if (options_.on_loop) return;
  thread_ = guarded_thread([this] { run(); },
                           [this](const std::string& why) { log_.error(kOrigin, "it has ended: " + why); });
}

BusRecorder::~BusRecorder() {
  stop();
}

// New topics, and those that have another number, because they were gone meanwhile.
void BusRecorder::subscribe() {
  graph_ = bus_.graph_version();
  const std::vector<TopicInfo> topics = bus_.topics();
  std::erase_if(recorded_, [&](const auto& entry) {
    const bool is_gone = std::ranges::none_of(
        topics, [&](const TopicInfo& topic) { return topic.id == entry.first && !topic.publishers.empty(); });
    if (is_gone) edge_->unsubscribe(entry.first);
    return is_gone;
  });
  for (const TopicInfo& topic : topics) {
    if (recorded_.contains(topic.id) || topic.publishers.empty() ||
        !options_.topics.selects(topic.name, topic.type))
      continue;
    const bool unpaused = std::ranges::find(options_.unpaused, topic.name) != options_.unpaused.end();
    recorded_[topic.id] = {.topic = writer_.add_topic(recorded_topic(topic)), .unpaused = unpaused};
    edge_->subscribe(topic.id);
  }
}

// A publisher that joins later keeps a latched message of its own on a topic that is recorded already.
void BusRecorder::count_publishers() {
  counted_ = bus_.graph_version();
  for (const TopicInfo& topic : bus_.topics()) {
    if (topic.latched && recorded_.contains(topic.id)) writer_.add_topic(recorded_topic(topic));
  }
}

void BusRecorder::record(const Edge::Incoming& message) {
  const auto found = recorded_.find(message.topic);
  if (found == recorded_.end()) return;
  Recorded& topic = found->second;
  if (topic.sequence != 0 && message.sequence > topic.sequence + 1)
    report_.lost[writer_.metadata().topics[topic.topic].name] += message.sequence - topic.sequence - 1;
  const std::int64_t stamp = std::max<std::int64_t>(0, nanoseconds_of(message.stamp));
  // A new message that is older than the one before it on its topic: time was set back, and a new file
  // begins. Otherwise log times ascend, also where a latched message or a picture is older than what came
  // before it.
  const bool is_set_back = message.sequence > topic.sequence && stamp < topic.stamp;
  time_ = is_set_back ? stamp : std::max(time_, stamp);
  topic.sequence = std::max(topic.sequence, message.sequence);
  topic.stamp = stamp;
  if (paused_ && !topic.unpaused) {
    latched_.keep(topic.topic, writer_.latched(topic.topic), message.sequence,
                  static_cast<std::uint64_t>(stamp), message.cdr);
    return;
  }
  writer_.write(topic.topic, message.sequence, static_cast<std::uint64_t>(time_),
                static_cast<std::uint64_t>(stamp), message.cdr);
  messages_.fetch_add(1, std::memory_order_relaxed);
  if (options_.on_message) options_.on_message(writer_.metadata().topics[topic.topic], message);
}

void BusRecorder::offer_services() {
  RecorderControl control;
  control.act = [this](RecorderAction what, std::function<void(bool)> done) {
    // The answer is given on the loop's thread, and let go there, because the task may live longer.
    act(what, [&bus = bus_, done = std::move(done)](bool fine) mutable {
      bus.post([done = std::move(done), fine]() mutable { std::exchange(done, nullptr)(fine); });
    });
  };
  control.is_paused = [this] { return is_paused(); };
  services_.emplace(bus_, std::move(control));
}

void BusRecorder::act(RecorderAction action, std::function<void(bool)> done) {
  {
    const std::lock_guard lock(requests_mutex_);
    if (!refusal_ && actions_.size() < kMaxRequests) {
      actions_.push_back({action, std::move(done)});
      return;
    }
  }
  done(false);
}

// From now on requests are refused where they come from, so that none waits for a thread that has ended.
void BusRecorder::refuse_requests(const std::string& why) {
  std::vector<Action> actions;
  std::vector<Copy> copies;
  {
    const std::lock_guard lock(requests_mutex_);
    refusal_ = why;
    actions.swap(actions_);
    copies.swap(copies_);
  }
  for (const Action& action : actions) action.done(false);
  for (const Copy& copy : copies) {
    if (copy.done) copy.done(why);
  }
}

void BusRecorder::serve_actions() {
  std::vector<Action> requests;
  {
    const std::lock_guard lock(requests_mutex_);
    requests.swap(actions_);
  }
  for (const Action& request : requests) request.done(do_action(request.what));
}

bool BusRecorder::do_action(RecorderAction what) {
  if (failed_) return false;
  switch (what) {
    case RecorderAction::pause:
    case RecorderAction::resume:
      pause(what == RecorderAction::pause);
      return true;
    case RecorderAction::toggle_paused:
      pause(!paused_);
      return true;
    case RecorderAction::split:
      writer_.split();
      return true;
    case RecorderAction::stop:
      end();
      return true;
    case RecorderAction::snapshot:
      break;
  }
  return false;
}

void BusRecorder::pause(bool yes) {
  if (paused_.exchange(yes) && !yes) latched_.write(writer_, static_cast<std::uint64_t>(time_));
}

// The bag is complete before the run ends.
void BusRecorder::end() {
  failed_ = true;
  for (const auto& [topic, recorded] : recorded_) edge_->unsubscribe(topic);
  recorded_.clear();
  close();
  refuse_requests("the recording has ended");
  log_.note(kOrigin, "the recording has ended, as its service stop was called");
}

void BusRecorder::copy(Copy request) {
  std::string refusal;
  {
    const std::lock_guard lock(requests_mutex_);
    const auto others = static_cast<std::size_t>(std::ranges::count(copies_, false, &Copy::is_urgent));
    if (!refusal_ && (request.is_urgent || others < kMaxRequests)) {
      const auto place =
          request.is_urgent ? std::ranges::find(copies_, false, &Copy::is_urgent) : copies_.end();
      copies_.insert(place, std::move(request));
      return;
    }
    refusal = refusal_.value_or(fmt::format("{} requests wait already", kMaxRequests));
  }
  if (request.done) request.done(refusal);
}

// One copy reads all that is kept, so that the ring would overflow during several of them.
BusRecorder::CopyKind BusRecorder::serve_copy() {
  Copy request;
  {
    const std::lock_guard lock(requests_mutex_);
    if (copies_.empty()) return CopyKind::none;
    request = std::move(copies_.front());
    copies_.erase(copies_.begin());
  }
  std::string failure;
  try {
    make_copy(request);
  } catch (...) {
    failure = thrown_text();
  }
  if (request.done) request.done(failure);
  return request.is_urgent ? CopyKind::urgent : CopyKind::other;
}

// The present file goes on and is read as a whole: many copies make no more files.
void BusRecorder::make_copy(const Copy& request) {
  writer_.flush();
  const auto last = static_cast<std::uint64_t>(request.last.count()), now = static_cast<std::uint64_t>(time_);
  const std::unique_ptr<BagWriter> out = request.make_bag();
  try {
    if (request.add_parts) request.add_parts(*out, now);
    BagReader bag(writer_.folder().string());
    copy_from(bag, now > last ? now - last : 0, UINT64_MAX, {.hidden = true}, *out);
    out->close();
  } catch (...) {
    out->discard();
    throw;
  }
}

// A file begins anew where time is set back, so that a span is the sum of their durations.
void BusRecorder::prune() {
  const std::vector<BagFileCount>& files = writer_.metadata().files;
  if (options_.keep <= Duration{}) return;
  std::uint64_t span = 0;
  for (const BagFileCount& file : files) span += file.duration;
  while (files.size() > 1) {
    span -= files.front().duration;
    if (span < static_cast<std::uint64_t>(options_.keep.count()) && files.size() <= kMaxKeptFiles &&
        writer_.size() <= options_.keep_bytes)
      return;
    writer_.remove_oldest();
  }
}

void BusRecorder::take_messages() {
  Edge::Incoming message;
  while (edge_->next(message)) {
    // The count is that of the time of the message: the first one of a publisher that has joined would else
    // replace the latched message of another.
    if (counted_ != bus_.graph_version()) count_publishers();
    record(message);
  }
}

void BusRecorder::take() {
  if (failed_) return;
  try {
    take_messages();
    if (graph_ != bus_.graph_version()) subscribe();
  } catch (const InputError& error) {
    fail(error.diagnostics().front().message);
  }
}

void BusRecorder::run() {
  if (options_.niceness != 0) setpriority(PRIO_PROCESS, 0, options_.niceness);  // on Linux: of this thread
  auto due = Clock::now() + kFlush;
  try {
    while (!ending_.load() && !failed_.load()) {
      std::this_thread::sleep_for(kLook);
      take_messages();
      serve_actions();
      if (failed_) return;
      if (graph_ != bus_.graph_version()) subscribe();
      prune();
      if (options_.on_look) options_.on_look();
      serve_copy();
      if (Clock::now() < due) continue;
      writer_.start_sync();
      due = Clock::now() + kFlush;
    }
    take_messages();
    serve_actions();
    if (options_.on_look) options_.on_look();
    // Nothing follows, so that all clients that wait would get the same messages: the end waits for one copy.
    CopyKind kind = CopyKind::none;
    do {
      kind = serve_copy();
      take_messages();
    } while (kind == CopyKind::urgent);
  } catch (const InputError& error) {
    fail(error.diagnostics().front().message);
  } catch (...) {
    fail(thrown_text());
  }
}

// The loop does not wait for a recorder that writes no more (let_catch_up).
void BusRecorder::fail(const std::string& why) {
  failed_ = true;
  report_.failure = why;
  if (options_.on_failure) {
    options_.on_failure(why);
  } else {
    log_.error(kOrigin, fmt::format("the recording has ended; what was written before is readable: {}", why));
  }
  for (const auto& [topic, recorded] : recorded_) edge_->unsubscribe(topic);
  refuse_requests(why);
}

void BusRecorder::close() {
  if (std::exchange(is_closed_, true)) return;
  try {
    std::vector<std::pair<std::string, std::string>> texts;
    for (const auto& [topic, count] : report_.lost) texts.emplace_back(topic, std::to_string(count));
    if (!texts.empty()) writer_.add_metadata("lost_messages", texts);
    writer_.close();
  } catch (const InputError& error) {
    if (report_.failure.empty()) report_.failure = error.diagnostics().front().message;
  }
  report_.bytes = writer_.size();
  report_.messages = std::min(messages_.load(), writer_.messages_in_files());
  std::uint64_t lost = 0;
  for (const auto& [topic, count] : report_.lost) lost += count;
  if (lost > 0) {
    log_.warning(kOrigin,
                 fmt::format("{} messages of {} topics were lost, because the disk did not keep up: {}", lost,
                             report_.lost.size(), report_.lost.begin()->first));
  }
}

void BusRecorder::let_catch_up() const {
  while (!failed_.load() && edge_->waiting_bytes() > options_.ring_bytes / 2)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

const RecorderReport& BusRecorder::stop() {
  if (edge_ == nullptr) return report_;
  if (thread_.joinable()) {
    ending_ = true;
    thread_.join();  // within kLook
  } else {
    take();
  }
  refuse_requests("the recording has ended");
  services_.reset();
  edge_.reset();
  close();
  return report_;
}

}  // namespace doppel
