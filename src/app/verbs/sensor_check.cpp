// doppel sensor check: one message of every topic of every sensor, and what it contains.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "app/verbs/output.h"
#include "app/verbs/sensor_verbs.h"
#include "doppel/messages/sensor_msgs.h"
#include "doppel/messages/tf2_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
namespace sensor = sensor_msgs::msg;

constexpr auto kFrames = std::chrono::milliseconds(1500);  // for the frames of /tf and /tf_static

struct TopicResult {
  std::string sensor, topic, type, frame, content;
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

void read_topics(Client& twin, std::span<TopicResult> results, double wait) {
  std::size_t silent = 0;
  for (const TopicResult& result : results)
    if (twin.topics().contains(result.topic)) {
      twin.subscribe(result.topic);
      ++silent;
    }
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(wait));
  Client::Received message;
  while (silent > 0 && twin.next(message, until)) {
    const auto result = std::ranges::find(results, message.topic, &TopicResult::topic);
    if (result == results.end() || result->came) continue;
    result->came = true;
    result->type = message.type;
    result->frame = frame_of(message);
    result->content = content_of(message);
    --silent;
  }
  for (const TopicResult& result : results)
    if (twin.topics().contains(result.topic)) twin.unsubscribe(result.topic);
}

std::string fault_of(const TopicResult& result, const std::set<std::string>& frames) {
  if (!result.came) return "no message came; is the simulation paused?";
  if (!frames.contains(result.frame)) return fmt::format("its frame '{}' is not in TF", result.frame);
  return "";
}

void print_table(const std::vector<TopicResult>& results, const std::set<std::string>& frames) {
  std::size_t sensor = 6, topic = 5, frame = 5;
  for (const TopicResult& result : results) {
    sensor = std::max(sensor, result.sensor.size());
    topic = std::max(topic, result.topic.size());
    frame = std::max(frame, result.frame.size());
  }
  print_line("{:<{}}  {:<{}}  {:<{}}  content\n", "sensor", sensor, "topic", topic, "frame", frame);
  const std::string* last = nullptr;
  for (const TopicResult& result : results) {
    const std::string fault = fault_of(result, frames);
    const bool again = last != nullptr && *last == result.sensor;
    print_line("{:<{}}  {:<{}}  {:<{}}  {}\n", again ? "" : result.sensor, sensor, result.topic, topic,
               result.frame, frame, fault.empty() ? result.content : "WRONG: " + fault);
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
    for (const std::string& topic : one.topics) results.push_back({one.name, topic, {}, {}, {}, false});
    const double period = one.rate > 0 ? 1 / one.rate : 0;
    read_topics(twin, {results.begin() + first, results.end()}, options.wait + period);
  }
  int wrong = 0;
  nlohmann::json list = nlohmann::json::array();
  for (const TopicResult& result : results) {
    const std::string fault = fault_of(result, frames);
    wrong += fault.empty() ? 0 : 1;
    list.push_back({{"sensor", result.sensor},
                    {"topic", result.topic},
                    {"type", result.type},
                    {"frame", result.frame},
                    {"content", result.content},
                    {"fault", fault}});
  }
  if (options.json) {
    print_out(list.dump(2) + "\n");
  } else if (results.empty()) {
    print_note("this twin has no sensors; <sensor> in <gazebo reference=\"link\"> adds one");
  } else {
    print_table(results, frames);
    print_note(fmt::format("{} topics, {} wrong", results.size(), wrong));
  }
  return wrong == 0 ? 0 : 1;
}

}  // namespace doppel::app
