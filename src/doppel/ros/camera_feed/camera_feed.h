#pragma once
// The pictures of the cameras of a bus for programs that read them by ZeroMQ, such as LeRobot with cameras
// of type zmq: a PUB socket over TCP whose messages are JSON,
//
//   {"timestamps": {"wrist": 12.4}, "images": {"wrist": "<base64 of a JPEG file>"}}
//
// with the last picture of every camera, at the rate of the fastest one. A camera is a topic of
// sensor_msgs/msg/Image in colour or grey; its name is that of the topic without "/image_raw". The protocol
// is ZMTP 3.0 with the mechanism NULL, which has no authentication. Without a subscriber no picture is
// computed.

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

class PublishingSocket;  // detail/publishing_socket.h

struct CameraFeedOptions {
  std::string host = "127.0.0.1";  // an IPv4 address of this machine
  std::uint16_t port = 5555;       // 0: a free one
  int quality = 90;                // of the JPEG files
};

// "5555" or "0.0.0.0:5555". Throws InputError.
[[nodiscard]] DOPPEL_API CameraFeedOptions camera_feed_options(const std::string& address);

class DOPPEL_API CameraFeed {
 public:
  // Listens from now on. The loop's thread. Throws InputError: the port is in use. The bus and the log
  // outlive it.
  CameraFeed(Bus& bus, const CameraFeedOptions& options, const Log& log);
  ~CameraFeed();
  CameraFeed(const CameraFeed&) = delete;
  CameraFeed& operator=(const CameraFeed&) = delete;

  // "tcp://127.0.0.1:5555"
  [[nodiscard]] std::string address() const;

 private:
  struct Camera {
    std::string name;
    std::string picture;  // base64 of its file; empty: none has come
    double stamp = 0;     // s
    bool fresh = false;   // it is not sent yet
    bool usable = true;   // a picture that JPEG has
  };
  void run();
  void follow_graph();
  void take_pictures();
  [[nodiscard]] std::size_t cameras_without_picture() const;
  void send();

  Bus& bus_;
  const int quality_;
  std::unique_ptr<PublishingSocket> socket_;
  std::unique_ptr<Edge> edge_;
  std::uint64_t graph_ = 0;            // the version of the last look
  bool listens_ = false;               // a subscriber is there
  double first_ = 0;                   // s, stamp of the first picture
  std::map<TopicId, Camera> cameras_;  // of the subscriptions
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace doppel
