#pragma once
// A board for the firmware of examples/firmware/doppel_servo: a clock that the test sets, a wire, and a check
// of every pulse. It knows from the firmware's acknowledgements what is permitted, and keeps the first
// breach.

#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "../../examples/firmware/doppel_servo/doppel_servo.h"

namespace doppel {

class WatchedBoard final : public doppel_servo::Board {
 public:
  struct Limits {
    std::int64_t min = 0, max = 0, speed = 0, acceleration = 0;  // as in `C`
  };
  struct Channel {
    Limits limits, asked;
    bool limited = false, enabled = false;
    std::int64_t width = 0, sampled = 0, moved = 0;  // ns; the last two of the last tick
  };

  std::uint32_t now = 1000;
  std::int32_t supply = -1;
  bool stop = false;
  std::uint32_t next_id = 0x8F3A00C1;
  std::array<std::uint16_t, 8> inputs{};
  std::array<Channel, doppel_servo::kMaxChannels> channels{};
  std::vector<std::string> lines;  // bodies that were sent
  std::string sent;                // all bytes
  std::string violation;           // the first one
  std::size_t pulses = 0;          // calls with a width

  std::uint32_t milliseconds() override { return now; }
  std::int32_t millivolts() override { return supply; }
  std::uint16_t analog(std::uint8_t input) override { return inputs[input]; }
  bool stop_pin() override { return stop; }
  std::uint32_t random_id() override { return next_id++; }

  void pulse(std::uint8_t index, std::uint32_t nanoseconds) override {
    Channel& channel = channels[index];
    if (nanoseconds != 0) {
      ++pulses;
      if (!channel.limited) fail(index, "a pulse without C");
      if (!channel.enabled) fail(index, "a pulse without E");
      if (nanoseconds < channel.limits.min * 1000 || nanoseconds > channel.limits.max * 1000)
        fail(index, "a pulse outside the limits: " + std::to_string(nanoseconds));
      if (channel.width == 0) {
        channel.sampled = nanoseconds;
        channel.moved = 0;
      }
    }
    channel.width = nanoseconds;
  }

  void send(const char* bytes, std::size_t size) override {
    sent.append(bytes, size);
    const std::string_view line(bytes, size);
    if (size > doppel_servo::kMaxLine || size < 8 || !line.ends_with('\n'))
      return fail(0, "a line that is none");
    const std::string_view body = line.substr(0, size - 7);
    lines.emplace_back(body);
    if (body.starts_with("A C ")) {
      Channel& channel = channels[static_cast<std::size_t>(std::stoi(std::string(body.substr(4))))];
      channel.limits = channel.asked;
      channel.limited = true;
    } else if (body.starts_with("A E ")) {
      const unsigned long mask = std::stoul(std::string(body.substr(4)));
      for (std::size_t i = 0; i < channels.size(); ++i) channels[i].enabled = (mask >> i & 1) != 0;
    } else if (body == "A R" || body.starts_with("! 20 relaxed")) {
      for (Channel& channel : channels) channel.enabled = false;
    } else if (body.starts_with("I ") && !known_boot(body)) {
      for (Channel& channel : channels) channel.limited = channel.enabled = false;
    }
  }

  // The limits that an intact line asks for; they hold from the firmware's acknowledgement on.
  void ask(std::string_view body) {
    if (!body.starts_with("C ")) return;
    std::array<std::int64_t, 5> words{};
    const std::string text(body.substr(2));
    const char* next = text.c_str();
    for (std::int64_t& word : words) {
      char* end = nullptr;
      word = std::strtoll(next, &end, 10);
      next = end;
    }
    if (words[0] < 0 || words[0] >= static_cast<std::int64_t>(channels.size())) return;
    channels[static_cast<std::size_t>(words[0])].asked = {words[1], words[2], words[3], words[4]};
  }

  // Call it after a tick that was that long after the one before. 1 us/s is 1 ns/ms.
  void check_motion(std::uint32_t elapsed) {
    for (std::size_t i = 0; i < channels.size(); ++i) {
      Channel& channel = channels[i];
      if (channel.width == 0) continue;
      const std::int64_t moved = channel.width - channel.sampled;
      if (std::abs(moved) > channel.limits.speed * elapsed + 1) fail(i, "too fast: " + std::to_string(moved));
      const std::int64_t change = std::abs(moved - channel.moved);
      if (elapsed == 1 && last_elapsed_ == 1 && change * 1000 > channel.limits.acceleration + 2000)
        fail(i, "accelerates too much: " + std::to_string(change));
      channel.sampled = channel.width;
      channel.moved = moved;
    }
    last_elapsed_ = elapsed;
  }

 private:
  void fail(std::size_t channel, const std::string& what) {
    if (violation.empty())
      violation = "channel " + std::to_string(channel) + " at " + std::to_string(now) + " ms: " + what;
  }
  // "I doppel-servo 1 CHANNELS BOOT ..."
  bool known_boot(std::string_view identity) {
    for (int word = 0; word < 4; ++word) identity.remove_prefix(identity.find(' ') + 1);
    const std::string boot(identity.substr(0, 8));
    const bool same = boot == boot_;
    boot_ = boot;
    return same;
  }

  std::uint32_t last_elapsed_ = 1;
  std::string boot_;
};

}  // namespace doppel
