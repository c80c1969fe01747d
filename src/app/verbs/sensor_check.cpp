// doppel sensor check: one message of every topic of every sensor, and what it contains.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "app/output.h"
#include "app/verbs/sensor_verbs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
namespace sensor = sensor_msgs::msg;

constexpr auto kFrames = std::chrono::milliseconds(1500);  // for the frames of /tf and /tf_static
constexpr double kMostWait = 120, kNoteAfter = 10;         // s of wall-clock time, of one sensor
constexpr const char* kStatus = "/doppel/status";

struct TopicResult {
  std::string sensor, topic, type, frame, content, fault;
  bool came = false;
};

std::string range_text(std::vector<float> values, std::size_t all) {
  if (values.empty()) return fmt::format("none of {} is finite", all);
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return fmt::format("{} of {} finite, {:.3g} to {:.3g} m", values.size(), all, *least, *most);
}

std::string image_content(const sensor::Image& image) {
  std::string out = fmt::format("{}x{} {}", image.width, image.height, image.encoding);
  if (image.encoding == "32FC1") {
    std::vector<float> depths;
    for (std::size_t i = 0; i + 4 <= image.data.size(); i += 4) {
      float depth = 0;
      std::memcpy(&depth, &image.data[i], 4);
      if (std::isfinite(depth)) depths.push_back(depth);
    }
    return out + ", " + range_text(std::move(depths), image.data.size() / 4);
  }
  const auto [least, most] = std::minmax_element(image.data.begin(), image.data.end());
  if (least != image.data.end()) out += fmt::format(", bytes {} to {}", *least, *most);
  return out;
}

std::string cloud_content(const sensor::PointCloud2& cloud) {
  std::vector<float> distances;
  const std::size_t points = std::size_t{cloud.width} * cloud.height;
  float p[3];
  if (cloud.point_step < sizeof p) return fmt::format("points of {} bytes", cloud.point_step);
  for (std::size_t at = 0; at + sizeof p <= cloud.data.size(); at += cloud.point_step) {
    std::memcpy(p, &cloud.data[at], sizeof p);
    const float distance = std::hypot(p[0], p[1], p[2]);
    if (std::isfinite(distance)) distances.push_back(distance);
  }
  return range_text(std::move(distances), points);
}

std::string content_of(const Client::Received& message) {
  if (message.type == "sensor_msgs/msg/Image") return image_content(decode<sensor::Image>(message.cdr));
  if (message.type == "sensor_msgs/msg/PointCloud2")
    return cloud_content(decode<sensor::PointCloud2>(message.cdr));
  if (message.type == "sensor_msgs/msg/CompressedImage") {
    const auto picture = decode<sensor::CompressedImage>(message.cdr);
    return fmt::format("{}, {} kB", picture.format, picture.data.size() / 1000);
  }
  if (message.type == "sensor_msgs/msg/CameraInfo") {
    const auto info = decode<sensor::CameraInfo>(message.cdr);
    return fmt::format("{}x{} {}, fx {:.4g}", info.width, info.height, info.distortion_model, info.k[0]);
  }
  if (message.type == "sensor_msgs/msg/LaserScan") {
    const auto scan = decode<sensor::LaserScan>(message.cdr);
    std::vector<float> ranges;
    std::copy_if(scan.ranges.begin(), scan.ranges.end(), std::back_inserter(ranges),
                 [](float range) { return std::isfinite(range); });
    return range_text(std::move(ranges), scan.ranges.size());
  }
  if (message.type == "sensor_msgs/msg/Range")
    return fmt::format("{:.3g} m", decode<sensor::Range>(message.cdr).range);
  return fmt::format("{} bytes", message.cdr.size());
}

// All messages of sensors begin with a std_msgs/Header: encapsulation, stamp, and the frame as length and text.
std::string frame_of(const Client::Received& message) {
  constexpr std::size_t kText = 16;
  if (message.cdr.size() < kText) return "";
  std::uint32_t length = 0;
  std::memcpy(&length, &message.cdr[kText - 4], 4);
  const std::size_t end = std::min(message.cdr.size(), kText + length);
  return decode<std_msgs::msg::Header>(std::span(message.cdr).first(end)).frame_id;
}

std::set<std::string> frames_of(Client& twin) {
  std::set<std::string> out{"world"};
  for (const auto& [name, topic] : twin.topics())
    if (name.ends_with("/tf") || name.ends_with("/tf_static")) twin.subscribe(name);
  const auto until = Clock::now() + kFrames;
  Client::Received message;
  while (twin.next(message, until))
    if (message.type == "tf2_msgs/msg/TFMessage")
      for (const auto& transform : decode<tf2_msgs::msg::TFMessage>(message.cdr).transforms) {
        out.insert(transform.header.frame_id);
        out.insert(transform.child_frame_id);
      }
  for (const auto& [name, topic] : twin.topics())
    if (name.ends_with("/tf") || name.ends_with("/tf_static")) twin.unsubscribe(name);
  return out;
}

// Decides from the reported time and samples of a sensor that a message of it is due.
class SensorProgress {
 public:
  explicit SensorProgress(const doppel_msgs::msg::Sensor& sensor)
      : name_(sensor.name), period_(sensor.rate > 0 ? 1 / sensor.rate : 0), samples_(sensor.samples) {}

  // Throws ClientError if the twin is paused.
  void add(const Client::Received& message) {
    if (message.topic == kSensorList) {
      const auto list = decode<doppel_msgs::msg::Sensors>(message.cdr).sensors;
      const auto own = std::ranges::find(list, name_, &doppel_msgs::msg::Sensor::name);
      made_ = made_ || (own != list.end() && own->samples > samples_);
      listed_ = listed_ || (start_ && now_ >= *start_ + period_);
    }
    if (message.topic != kStatus) return;
    const auto status = decode<doppel_msgs::msg::TwinStatus>(message.cdr);
    if (status.paused)
      throw ClientError(
          "the twin is paused, so its sensors publish nothing; continue it, e.g. by `doppel service call "
          "/gazebo/unpause_physics std_srvs/srv/Empty`, and check again");
    now_ = status.sim_time;
    start_ = std::min(start_.value_or(now_), now_);  // after a reset from its new time
    factor_ = status.real_time_factor;
  }

  // The latency is over; the other topics may begin with the next sample.
  void first_message_came() {
    start_.reset();
    came_ = true;
    listed_ = false;
  }
  // The period is over, and no sample waits for its latency.
  [[nodiscard]] bool is_over() const { return is_too_slow() || (listed_ && (came_ || !made_)); }
  [[nodiscard]] bool is_too_slow() const { return factor_ > 0 && period_ > kMostWait * factor_; }

  [[nodiscard]] std::string fault(double waited) const {
    std::string out = fmt::format("no message came within {:.0f} s", waited);
    if (is_too_slow())
      out += fmt::format("; its period of {:.3g} s takes more than the {:.0f} s of this check", period_,
                         kMostWait);
    else if (made_ && !came_)
      out += ", but samples are made; is its <doppel:latency> longer?";
    return out;
  }
  [[nodiscard]] std::string note() const {
    return fmt::format("waiting for {}: its period is {:.3g} s of simulated time, its latency may be longer",
                       name_, period_);
  }

 private:
  std::string name_;
  double period_;                // s of simulated time
  std::uint64_t samples_;        // before the topics were read
  std::optional<double> start_;  // s of simulated time
  double now_ = 0, factor_ = 0;
  bool made_ = false;    // a sample
  bool came_ = false;    // a message
  bool listed_ = false;  // after the period
};

std::set<std::string> topics_to_read(Client& twin, std::span<const TopicResult> results) {
  std::set<std::string> out{kStatus, kSensorList};
  for (const TopicResult& result : results) out.insert(result.topic);
  std::erase_if(out, [&](const std::string& topic) { return !twin.topics().contains(topic); });
  return out;
}

void note_message(TopicResult& result, const Client::Received& message) {
  result.came = true;
  result.type = message.type;
  result.frame = frame_of(message);
  result.content = content_of(message);
}

// Waits `wait` s of wall-clock time, then until the sensor's period has passed in simulated time.
void read_topics(Client& twin, const doppel_msgs::msg::Sensor& of, std::span<TopicResult> results,
                 double wait) {
  constexpr auto kLook = std::chrono::milliseconds(100);
  const std::set<std::string> topics = topics_to_read(twin, results);
  for (const std::string& topic : topics) twin.subscribe(topic);
  SensorProgress progress(of);
  const auto start = Clock::now();
  double waited = 0;
  bool noted = false;
  const auto is_silent = [](const TopicResult& result) { return !result.came; };
  while (std::ranges::any_of(results, is_silent)) {
    waited = std::chrono::duration<double>(Clock::now() - start).count();
    if (waited >= std::max(wait, kMostWait) || (waited >= wait && progress.is_over())) break;
    if (waited >= kNoteAfter && !std::exchange(noted, true)) print_note(progress.note());
    Client::Received message;
    if (!twin.next(message, Clock::now() + kLook)) continue;
    progress.add(message);
    const auto result = std::ranges::find(results, message.topic, &TopicResult::topic);
    if (result == results.end() || result->came) continue;
    if (std::ranges::all_of(results, is_silent)) progress.first_message_came();
    note_message(*result, message);
  }
  for (TopicResult& result : results)
    if (!result.came) result.fault = progress.fault(waited);
  for (const std::string& topic : topics) twin.unsubscribe(topic);
}

void find_missing_frames(std::span<TopicResult> results, const std::set<std::string>& frames) {
  for (TopicResult& result : results)
    if (result.came && !frames.contains(result.frame))
      result.fault = fmt::format("its frame '{}' is not in TF", result.frame);
}

void print_table(const std::vector<TopicResult>& results) {
  std::size_t sensor = 6, topic = 5, frame = 5;
  for (const TopicResult& result : results) {
    sensor = std::max(sensor, result.sensor.size());
    topic = std::max(topic, result.topic.size());
    frame = std::max(frame, result.frame.size());
  }
  print_line("{:<{}}  {:<{}}  {:<{}}  content\n", "sensor", sensor, "topic", topic, "frame", frame);
  const std::string* last = nullptr;
  for (const TopicResult& result : results) {
    const bool again = last != nullptr && *last == result.sensor;
    print_line("{:<{}}  {:<{}}  {:<{}}  {}\n", again ? "" : result.sensor, sensor, result.topic, topic,
               result.frame, frame, result.fault.empty() ? result.content : "WRONG: " + result.fault);
    last = &result.sensor;
  }
}

}  // namespace

int check_sensors(Shell& shell, const SensorCheckOptions& options) {
  Client& twin = shell.twin();
  const std::set<std::string> frames = frames_of(twin);
  std::vector<TopicResult> results;
  // One sensor after the other, so that a slow machine makes the data of one at a time.
  for (const auto& one : sensors_of(twin).sensors) {
    const auto first = static_cast<std::ptrdiff_t>(results.size());
    // Cameras of one sensor may share a topic.
    for (const std::string& topic : std::set(one.topics.begin(), one.topics.end()))
      results.push_back({one.name, topic, {}, {}, {}, {}, false});
    read_topics(twin, one, {results.begin() + first, results.end()}, options.wait);
  }
  find_missing_frames(results, frames);
  int wrong = 0;
  nlohmann::json list = nlohmann::json::array();
  for (const TopicResult& result : results) {
    wrong += result.fault.empty() ? 0 : 1;
    list.push_back({{"sensor", result.sensor},
                    {"topic", result.topic},
                    {"type", result.type},
                    {"frame", result.frame},
                    {"content", result.content},
                    {"fault", result.fault}});
  }
  if (options.json) {
    print_out(list.dump(2) + "\n");
  } else if (results.empty()) {
    print_note("this twin has no sensors; <sensor> in <gazebo reference=\"link\"> adds one");
  } else {
    print_table(results);
    print_note(fmt::format("{} topics, {} wrong", results.size(), wrong));
  }
  return wrong == 0 ? 0 : 1;
}

}  // namespace doppel::app
