#include "doppel/ros/camera_feed/camera_feed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/text.h"
#include "doppel/base/images/image.h"
#include "doppel/ros/camera_feed/detail/publishing_socket.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

constexpr double kMaxWait = 2;  // s, until messages lack a camera of which no picture has come
constexpr int kLook = 100;      // ms, until the thread looks at the graph, and whether it is to end
constexpr std::string_view kOrigin = "cameras";
constexpr std::string_view kPictureTopic = "/image_raw";

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = (bits << 8) | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? kDigits[(bits >> (18 - 6 * k)) & 63] : '=';
  }
  return out;
}

std::string camera_name(std::string_view topic) {
  if (topic.ends_with(kPictureTopic) && topic.size() > kPictureTopic.size())
    topic.remove_suffix(kPictureTopic.size());
  topic.remove_prefix(1);
  return std::string(topic);
}

// nullopt: a picture that JPEG does not have, such as a depth.
std::optional<Bitmap> bitmap_of(sensor_msgs::msg::Image& image) {
  Bitmap out;
  out.width = static_cast<int>(image.width);
  out.height = static_cast<int>(image.height);
  const bool colour = image.encoding == "rgb8" || image.encoding == "bgr8";
  out.channels = colour ? 3 : 1;
  const std::size_t row = std::size_t{image.width} * static_cast<std::size_t>(out.channels);
  if (!(colour || image.encoding == "mono8") || image.step != row || image.data.empty() ||
      image.data.size() != row * image.height)
    return {};
  out.pixels = std::move(image.data);
  if (image.encoding == "bgr8") {
    for (std::size_t i = 0; i + 2 < out.pixels.size(); i += 3) std::swap(out.pixels[i], out.pixels[i + 2]);
  }
  return out;
}

}  // namespace

CameraFeedOptions camera_feed_options(const std::string& address) {
  CameraFeedOptions out;
  const std::size_t colon = address.rfind(':');
  if (colon != std::string::npos) out.host = address.substr(0, colon);
  const std::optional<double> port =
      parse_number(colon == std::string::npos ? address : address.substr(colon + 1));
  constexpr int kLastPort = 65535;
  if (!port || *port != static_cast<int>(*port) || *port < 0 || *port > kLastPort)
    throw InputError("cameras.address", {}, fmt::format("'{}' is no port of the cameras", address),
                     "write --zmq-cameras 5555, or 0.0.0.0:5555 for other machines");
  out.port = static_cast<std::uint16_t>(*port);
  return out;
}

CameraFeed::CameraFeed(Bus& bus, const CameraFeedOptions& options, const Log& log)
    : bus_(bus),
      quality_(options.quality),
      socket_(std::make_unique<PublishingSocket>(options)),
      edge_(bus.attach("cameras", {.ring_bytes = std::size_t{32} << 20})) {
  thread_ = guarded_thread([this] { run(); },
                           [&log](const std::string& why) { log.error(std::string(kOrigin), why); });
}

CameraFeed::~CameraFeed() {
  ends_ = true;
  edge_->wake();
  thread_.join();
}

std::string CameraFeed::address() const {
  return socket_->address();
}

void CameraFeed::run() {
  while (!ends_) {
    socket_->wait(edge_->readable_fd(), kLook);
    if (listens_ != socket_->has_subscriber() || graph_ != bus_.graph_version()) follow_graph();
    take_pictures();
  }
}

// The subscriptions are those of the present topics while someone subscribes to the pictures.
void CameraFeed::follow_graph() {
  listens_ = socket_->has_subscriber();
  graph_ = bus_.graph_version();
  std::map<TopicId, Camera> before;
  before.swap(cameras_);
  if (listens_) {
    for (const TopicInfo& topic : bus_.topics()) {
      if (topic.type != sensor_msgs::msg::Image::kType || topic.publishers.empty()) continue;
      const auto found = before.find(topic.id);
      if (found == before.end()) {
        edge_->subscribe(topic.id);
        cameras_[topic.id].name = camera_name(topic.name);
      } else {
        cameras_.insert(before.extract(found));
      }
    }
  }
  for (const auto& [topic, camera] : before) edge_->unsubscribe(topic);
}

// All cameras are in one message, because a reader that does not find its own takes the first one. It is
// complete when each camera has a new picture, or when one has two.
void CameraFeed::take_pictures() {
  Edge::Incoming message;
  while (edge_->next(message)) {
    const auto found = cameras_.find(message.topic);
    if (found == cameras_.end()) continue;
    Camera& camera = found->second;
    sensor_msgs::msg::Image image;
    if (!from_cdr(message.cdr, image)) continue;
    const double stamp = image.header.stamp.sec + 1e-9 * image.header.stamp.nanosec;
    const std::optional<Bitmap> bitmap = bitmap_of(image);
    camera.usable = bitmap.has_value();
    if (!bitmap) continue;
    if (cameras_without_picture() == cameras_.size()) first_ = stamp;
    if (camera.fresh) send();
    camera.picture = base64(encode_jpeg(*bitmap, quality_));
    camera.stamp = stamp;
    camera.fresh = true;
    const auto waits = [](const auto& entry) { return entry.second.usable && !entry.second.fresh; };
    if (std::ranges::none_of(cameras_, waits)) send();
  }
}

std::size_t CameraFeed::cameras_without_picture() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(cameras_, [](const auto& entry) { return entry.second.picture.empty(); }));
}

void CameraFeed::send() {
  double newest = first_;
  bool lacks = false;
  for (const auto& [topic, camera] : cameras_) {
    newest = std::max(newest, camera.stamp);
    lacks = lacks || (camera.usable && camera.picture.empty());
  }
  if (lacks && newest < first_ + kMaxWait) return;
  nlohmann::json message{{"timestamps", nlohmann::json::object()}, {"images", nlohmann::json::object()}};
  for (auto& [topic, camera] : cameras_) {
    if (camera.picture.empty()) continue;
    message["timestamps"][camera.name] = camera.stamp;
    message["images"][camera.name] = camera.picture;
    camera.fresh = false;
  }
  socket_->publish(message.dump());
}

}  // namespace doppel
