#include "doppel/ros/camera_feed/camera_feed.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <list>
#include <nlohmann/json.hpp>

#include "doppel/base/images/image.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

using namespace std::string_literals;

// A subscriber to everything, by the bytes of ZMTP 3.0.
class Subscriber {
 public:
  explicit Subscriber(const std::string& address) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&where), sizeof where), 0);
    const timeval patience{.tv_sec = 0, .tv_usec = 20'000};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    std::string hello = "\xFF\0\0\0\0\0\0\0\0\x7F\3\0NULL"s;
    hello.resize(64);
    hello += "\4\x19\5READY\xBSocket-Type\0\0\0\3SUB\0\1\1"s;
    EXPECT_EQ(::send(fd_, hello.data(), hello.size(), 0), static_cast<ssize_t>(hello.size()));
  }
  ~Subscriber() { ::close(fd_); }
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  // The publisher has closed the connection.
  [[nodiscard]] bool is_closed() const {
    char byte = 0;
    const ssize_t count = ::recv(fd_, &byte, 1, MSG_PEEK);
    return count == 0 || (count < 0 && errno == ECONNRESET);
  }

  // The next message, if it has come whole; null otherwise.
  nlohmann::json next() {
    std::array<char, 65536> bytes{};
    const ssize_t count = ::recv(fd_, bytes.data(), bytes.size(), 0);
    if (count > 0) received_.append(bytes.data(), static_cast<std::size_t>(count));
    constexpr std::size_t kHello = 64 + 27;  // greeting and READY
    if (received_.size() < kHello + 2) return {};
    const bool is_long = received_[kHello] == 2;
    const std::size_t head = is_long ? 9 : 2;
    std::uint64_t size = 0;
    for (std::size_t i = 1; i < head; ++i)
      size = (size << 8) | static_cast<std::uint8_t>(received_[kHello + i]);
    if (received_.size() < kHello + head + size) return {};
    const nlohmann::json out = nlohmann::json::parse(received_.substr(kHello + head, size));
    received_.erase(kHello, head + size);
    return out;
  }

 private:
  int fd_;
  std::string received_;
};

std::string from_base64(const std::string& text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char digit : text) {
    if (digit == '=') break;
    bits = (bits << 6) | static_cast<std::uint32_t>(kDigits.find(digit));
    count += 6;
    if (count >= 8) out += static_cast<char>((bits >> (count -= 8)) & 0xFF);
  }
  return out;
}

sensor_msgs::msg::Image picture(const std::string& encoding, std::uint8_t first, int second) {
  sensor_msgs::msg::Image out;
  out.header.stamp.sec = second;
  out.width = 16;
  out.height = 8;
  out.encoding = encoding;
  const std::uint32_t channels = encoding == "mono8" ? 1 : encoding == "32FC1" ? 4 : 3;
  out.step = out.width * channels;
  out.data.assign(std::size_t{out.step} * out.height, 0);
  for (std::size_t i = 0; i < out.data.size(); i += channels) out.data[i] = first;
  return out;
}

class CameraFeedTest : public testing::Test {
 protected:
  CameraFeedTest() : node_(bus_, "/robot"), feed_(bus_, {.port = 0}, log_) {}

  // Runs the loop until it is true, or 5 s have passed.
  template <class Condition>
  bool run_until(Condition done) {
    for (int i = 0; i < 500; ++i) {
      bus_.spin();
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  Log log_;
  Bus bus_;
  Node node_;
  CameraFeed feed_;
};

TEST_F(CameraFeedTest, MessageHasEveryCamera) {
  const auto wrist = node_.advertise<sensor_msgs::msg::Image>("/wrist/image_raw");
  const auto front = node_.advertise<sensor_msgs::msg::Image>("/front/image_raw");
  const auto depth = node_.advertise<sensor_msgs::msg::Image>("/depth/image_raw");
  EXPECT_FALSE(wrist.has_listeners()) << "expected no picture to be computed without a subscriber";
  Subscriber subscriber(feed_.address());
  ASSERT_TRUE(
      run_until([&] { return wrist.has_listeners() && front.has_listeners() && depth.has_listeners(); }));
  nlohmann::json message;
  int second = 0;
  ASSERT_TRUE(run_until([&] {
    ++second;
    depth.publish(picture("32FC1", 9, second), Time{});
    wrist.publish(picture("rgb8", 250, second), Time{});
    front.publish(picture("bgr8", 250, second), Time{});
    const nlohmann::json next = subscriber.next();
    if (!next.is_null()) message = next;
    return !message.is_null() && message["images"].size() == 2;
  }));
  EXPECT_EQ(message["timestamps"]["wrist"], message["timestamps"]["front"]);
  const Bitmap red = decode_image(from_base64(message["images"]["wrist"]), "wrist");
  const Bitmap blue = decode_image(from_base64(message["images"]["front"]), "front");
  ASSERT_EQ(red.width, 16);
  ASSERT_EQ(red.height, 8);
  EXPECT_GT(red.at(8, 4)[0], 230);
  EXPECT_LT(red.at(8, 4)[2], 20);
  EXPECT_GT(blue.at(8, 4)[2], 230);
}

TEST_F(CameraFeedTest, CameraThatStopsKeepsItsLastPicture) {
  const auto wrist = node_.advertise<sensor_msgs::msg::Image>("/wrist/image_raw");
  const auto front = node_.advertise<sensor_msgs::msg::Image>("/front/image_raw");
  Subscriber subscriber(feed_.address());
  ASSERT_TRUE(run_until([&] { return wrist.has_listeners() && front.has_listeners(); }));
  front.publish(picture("mono8", 100, 1), Time{});
  int second = 1;
  EXPECT_TRUE(run_until([&] {
    wrist.publish(picture("rgb8", 250, ++second), Time{});
    const nlohmann::json next = subscriber.next();
    return !next.is_null() && next["images"].size() == 2 && next["timestamps"]["wrist"] >= 4.0 &&
           next["timestamps"]["front"] == 1.0;
  }));
}

TEST_F(CameraFeedTest, LastSubscriberEndsPictures) {
  const auto wrist = node_.advertise<sensor_msgs::msg::Image>("/wrist/image_raw");
  {
    const Subscriber subscriber(feed_.address());
    ASSERT_TRUE(run_until([&] { return wrist.has_listeners(); }));
  }
  EXPECT_TRUE(run_until([&] { return !wrist.has_listeners(); }));
}

TEST_F(CameraFeedTest, ConnectionBeyondTheirNumberIsClosed) {
  constexpr int kMaxConnections = 32;
  const auto wrist = node_.advertise<sensor_msgs::msg::Image>("/wrist/image_raw");
  std::list<Subscriber> present;
  for (int i = 0; i < kMaxConnections; ++i) present.emplace_back(feed_.address());
  const Subscriber surplus(feed_.address());
  EXPECT_TRUE(run_until([&] { return surplus.is_closed(); }));
  int second = 0;
  const auto gets_picture = [&](Subscriber& one) {
    return run_until([&] {
      wrist.publish(picture("rgb8", 250, ++second), Time{});
      return !one.next().is_null();
    });
  };
  EXPECT_TRUE(gets_picture(present.front()));
  EXPECT_TRUE(gets_picture(present.back()));
  present.pop_front();
  Subscriber late(feed_.address());
  EXPECT_TRUE(gets_picture(late)) << "expected a connection to be accepted again";
}

TEST_F(CameraFeedTest, TakenPortIsNamed) {
  const std::string address = feed_.address();
  const CameraFeedOptions same = camera_feed_options(address.substr(std::string("tcp://").size()));
  try {
    const CameraFeed second(bus_, same, log_);
    ADD_FAILURE() << "expected the second one to be refused";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("in use"), std::string::npos) << error.what();
  }
}

TEST(CameraFeedOptions, AddressMayHaveHost) {
  EXPECT_EQ(camera_feed_options("5555").port, 5555);
  EXPECT_EQ(camera_feed_options("0.0.0.0:5556").host, "0.0.0.0");
  EXPECT_THROW(static_cast<void>(camera_feed_options("abc")), InputError);
  EXPECT_THROW(static_cast<void>(camera_feed_options("70000")), InputError);
}

}  // namespace
}  // namespace doppel
