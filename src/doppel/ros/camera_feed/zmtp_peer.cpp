#include "doppel/ros/camera_feed/detail/zmtp_peer.h"

#include <algorithm>
#include <array>

namespace doppel {
namespace {

constexpr std::size_t kGreeting = 64;
constexpr std::size_t kVersion = 10, kMechanism = 12, kMechanismSize = 20;
constexpr char kMajor = 3;
constexpr std::uint8_t kMore = 1, kLong = 2, kCommand = 4;
constexpr std::size_t kMaxFrame = 4096;  // of a subscriber, which sends subscriptions only
constexpr std::size_t kMaxPrefixes = 64;
constexpr std::size_t kPingTime = 2;  // bytes of a PING in front of its context

std::string greeting() {
  std::string out(kGreeting, '\0');
  out[0] = '\xFF';
  out[kVersion - 1] = '\x7F';
  out[kVersion] = kMajor;
  out.replace(kMechanism, 4, "NULL");
  return out;
}

// The name of a command, or of a property; empty: size is none.
std::string_view short_text(std::string_view body) {
  const std::size_t size = body.empty() ? 0 : static_cast<std::uint8_t>(body[0]);
  return body.size() < 1 + size ? std::string_view{} : body.substr(1, size);
}

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t out = 0;
  for (const char byte : bytes) out = (out << 8) | static_cast<std::uint8_t>(byte);
  return out;
}

std::string big_endian(std::uint64_t value, std::size_t size) {
  std::string out(size, '\0');
  for (std::size_t i = size; i-- > 0; value >>= 8) out[i] = static_cast<char>(value & 0xFF);
  return out;
}

std::string ready_command() {
  constexpr std::string_view kName = "Socket-Type", kValue = "PUB";
  std::string out{"\x05READY"};
  out += static_cast<char>(kName.size());
  out += kName;
  out += big_endian(kValue.size(), 4);
  out += kValue;
  return out;
}

bool is_subscriber(std::string_view properties) {
  while (!properties.empty()) {
    const std::string_view name = short_text(properties);
    if (name.empty() || properties.size() < 1 + name.size() + 4) return false;
    properties.remove_prefix(1 + name.size());
    const std::uint64_t size = big_endian(properties.substr(0, 4));
    if (size > properties.size() - 4) return false;
    const std::string_view value = properties.substr(4, size);
    if (name == "Socket-Type") return value == "SUB" || value == "XSUB";
    properties.remove_prefix(4 + size);
  }
  return false;
}

}  // namespace

ZmtpPeer::ZmtpPeer() : out_(greeting()) {}

bool ZmtpPeer::receive(std::string_view bytes) {
  received_ += bytes;
  if (!greeted_ && !read_greeting()) return false;
  return !greeted_ || read_frames();
}

bool ZmtpPeer::read_greeting() {
  const std::size_t size = received_.size();
  if (size > 0 && received_[0] != '\xFF') return false;
  if (size > kVersion && (received_[kVersion - 1] != '\x7F' || received_[kVersion] < kMajor)) return false;
  if (size < kGreeting) return true;
  std::string null("NULL");
  null.resize(kMechanismSize);
  if (received_.compare(kMechanism, kMechanismSize, null) != 0) return false;
  received_.erase(0, kGreeting);
  greeted_ = true;
  add_frame(kCommand, ready_command());
  return true;
}

bool ZmtpPeer::read_frames() {
  while (!received_.empty()) {
    Frame frame;
    frame.flags = static_cast<std::uint8_t>(received_[0]);
    if (frame.flags > (kMore | kLong | kCommand)) return false;
    const std::size_t head = (frame.flags & kLong) != 0 ? 9 : 2;
    if (received_.size() < head) return true;
    const std::uint64_t size = big_endian(std::string_view(received_).substr(1, head - 1));
    if (size > kMaxFrame) return false;
    if (received_.size() < head + size) return true;
    frame.body = std::string_view(received_).substr(head, size);
    if (!read(frame)) return false;
    received_.erase(0, head + size);
  }
  return true;
}

bool ZmtpPeer::read(const Frame& frame) {
  if ((frame.flags & kCommand) != 0) return read_command(frame.body);
  if (!ready_) return false;
  // ZMTP 3.0: a subscription is a message.
  if (!frame.body.empty() && (frame.body[0] == 0 || frame.body[0] == 1))
    add_subscription(frame.body[0] == 1, frame.body.substr(1));
  return true;
}

bool ZmtpPeer::read_command(std::string_view body) {
  const std::string_view name = short_text(body);
  if (name.empty()) return false;
  const std::string_view rest = body.substr(1 + name.size());
  if (!ready_) {
    ready_ = name == "READY" && is_subscriber(rest);
    return ready_;
  }
  if (name == "SUBSCRIBE" || name == "CANCEL") add_subscription(name == "SUBSCRIBE", rest);
  if (name == "PING" && rest.size() >= kPingTime && has_room())
    add_frame(kCommand, "\x04PONG" + std::string(rest.substr(kPingTime)));
  return name != "ERROR";
}

void ZmtpPeer::add_subscription(bool on, std::string_view prefix) {
  if (on && prefixes_.size() < kMaxPrefixes) prefixes_.emplace_back(prefix);
  const auto found = std::ranges::find(prefixes_, prefix);
  if (!on && found != prefixes_.end()) prefixes_.erase(found);
}

bool ZmtpPeer::subscribes(std::string_view message) const {
  return ready_ && std::ranges::any_of(
                       prefixes_, [&](const std::string& prefix) { return message.starts_with(prefix); });
}

void ZmtpPeer::send(std::string_view message) {
  add_frame(0, message);
}

void ZmtpPeer::add_frame(std::uint8_t flags, std::string_view body) {
  constexpr std::size_t kLastShort = 255;
  const bool is_long = body.size() > kLastShort;
  out_ += static_cast<char>(is_long ? flags | kLong : flags);
  out_ += big_endian(body.size(), is_long ? 8 : 1);
  out_ += body;
}

// A reader that is a little slow never takes the last byte: what it has taken is freed before it is more than
// what waits, so that each byte is moved once at most.
void ZmtpPeer::take(std::size_t bytes) {
  written_ += bytes;
  if (written_ <= waiting().size()) return;
  out_.erase(0, written_);
  written_ = 0;
}

}  // namespace doppel
