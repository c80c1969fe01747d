#include "doppel/session/live/health_publisher.h"

#include <sys/resource.h>

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "doppel/base/core/abandoned_thread.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/review/audit/report_places.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kThreadNiceness = 10;  // the thread's niceness: the loop comes first
constexpr std::chrono::milliseconds kShutdownTimeout{200};

std::string absolute_file(const SourceLocation& where) {
  std::error_code none;
  return where.known() ? std::filesystem::absolute(*where.file, none).lexically_normal().string() : "";
}

Json place_of(const SourceLocation& where) {
  return {{"file", absolute_file(where)}, {"line", where.line}, {"column", where.column}};
}

Json places_of(const std::vector<SourcePlaces::Named>& named) {
  Json out = Json::object();
  for (const auto& [name, where] : named) {
    Json place = place_of(where);
    place["shown"] = where.known() ? shown_path(*where.file) : "";
    Json stack = Json::array();
    for (const auto* call : calls(where)) {
      stack.push_back(place_of(call->call));
      stack.back()["what"] = call->what;
    }
    place["stack"] = std::move(stack);
    out[name] = std::move(place);
  }
  return out;
}

// The failure as a report of `doppel check --json` with one finding, which the page shows.
std::string failure_json(const std::string& what) {
  return to_json(refusal_report(
      InputError("health.failed", {}, "the description could not be checked: " + what), "the running twin"));
}

}  // namespace

SourcePlaces source_places(const RobotDescription& robot) {
  SourcePlaces out;
  for (const Link& link : robot.links) out.links.emplace_back(link.name, link.source);
  for (const Joint& joint : robot.joints) out.joints.emplace_back(joint.name, joint.source);
  return out;
}

std::string to_json(const SourcePlaces& places) {
  return Json{{"links", places_of(places.links)}, {"joints", places_of(places.joints)}}.dump(
      -1, ' ', false, Json::error_handler_t::replace);
}

// The publishers of the loop's thread; tasks after the end find them destroyed.
struct HealthPublisher::Publishers {
  Publishers(Bus& bus, const std::string& name_space, std::function<void()> published)
      : node(bus, in_namespace(name_space, "doppel")), on_published(std::move(published)) {
    health = node.advertise<std_msgs::msg::String>("~/health", {.depth = 1, .latched = true});
    sources = node.advertise<std_msgs::msg::String>("~/sources", {.depth = 1, .latched = true});
  }
  Node node;
  Publisher<std_msgs::msg::String> health, sources;
  std::function<void()> on_published;
};

// The state shared by the publisher and its thread.
struct HealthPublisher::SharedState {
  SharedState(Bus& the_bus, std::weak_ptr<Publishers> the_publishers)
      : bus(the_bus), publishers(std::move(the_publishers)) {}

  void run(const std::function<std::string()>& make_report) {
    setpriority(PRIO_PROCESS, 0, kThreadNiceness);  // on Linux: of this thread
    std::unique_lock lock(mutex);
    while (true) {
      busy = false;
      change.notify_all();
      change.wait(lock, [this] { return ending || wanted; });
      if (ending) return;
      const SourcePlaces places = *std::exchange(wanted, std::nullopt);
      busy = true;
      lock.unlock();
      try {
        publish(&Publishers::sources, to_json(places));
        publish(&Publishers::health, make_report());
      } catch (...) {
        publish(&Publishers::health, failure_json(thrown_text()));
      }
      lock.lock();
    }
  }

  void publish(Publisher<std_msgs::msg::String> Publishers::*topic, std::string text) {
    const std::lock_guard lock(mutex);
    if (ending) return;
    std_msgs::msg::String message;
    message.data = std::move(text);
    bus.post([weak = publishers, topic, message = std::move(message)] {
      const auto open = weak.lock();
      if (!open) return;
      ((*open).*topic).publish(message, open->node.bus().now());
      if (topic == &Publishers::health && open->on_published) open->on_published();
    });
  }

  void end() {
    const std::lock_guard lock(mutex);
    busy = false;
    change.notify_all();
  }

  Bus& bus;  // until `ending`
  std::weak_ptr<Publishers> publishers;
  std::mutex mutex;
  std::condition_variable change;
  std::optional<SourcePlaces> wanted;  // not yet reported
  bool busy = false, ending = false;
};

HealthPublisher::HealthPublisher(Bus& bus, const std::string& name_space,
                                 std::function<std::string()> make_report, std::function<void()> on_published)
    : publishers_(std::make_shared<Publishers>(bus, name_space, std::move(on_published))),
      shared_(std::make_shared<SharedState>(bus, publishers_)) {
  // Without memory for a text there is none for a report about it: the topics keep their last messages.
  thread_ =
      guarded_thread([shared = shared_, make_report = std::move(make_report)] { shared->run(make_report); },
                     [shared = shared_](const std::string&) { shared->end(); });
}

HealthPublisher::~HealthPublisher() {
  std::unique_lock lock(shared_->mutex);
  shared_->ending = true;
  shared_->change.notify_all();
  const bool rests = shared_->change.wait_for(lock, kShutdownTimeout, [this] { return !shared_->busy; });
  lock.unlock();
  if (rests) {
    thread_.join();
  } else {
    mark_thread_abandoned();
    thread_.detach();
  }
}

void HealthPublisher::retire() {
  publishers_.reset();
  const std::lock_guard lock(shared_->mutex);
  shared_->ending = true;
  shared_->change.notify_all();
}

bool HealthPublisher::has_ended() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->ending && !shared_->busy;
}

void HealthPublisher::look_at(const RobotDescription& robot) {
  SourcePlaces places = source_places(robot);
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->wanted = std::move(places);
  }
  shared_->change.notify_all();
}

}  // namespace doppel
