#pragma once
// A firmware on a watched board, and what a test says to it. The host's own code makes the lines and reads
// the answers.

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "doppel/devices/frames/servo_line.h"
#include "watched_board.h"

namespace doppel {

class ServoFirmware : public testing::Test {
 protected:
  WatchedBoard board;
  doppel_servo::Config config;
  doppel_servo::Firmware firmware{board, configured()};

  static doppel_servo::Config configured() {
    doppel_servo::Config out;
    out.channels = 3;
    out.inputs = 2;
    out.step_ns = 305;
    return out;
  }

  void TearDown() override { EXPECT_EQ(board.violation, ""); }

  void put(std::string_view bytes) {
    for (const char byte : bytes) firmware.receive(static_cast<std::uint8_t>(byte));
  }
  static std::string whole(std::string_view body) {
    FrameBytes out;
    add_servo_line(body, out);
    return {reinterpret_cast<const char*>(out.bytes().data()), out.size()};
  }
  // The bodies of what it answers, one after the other with a bar between.
  std::string say(std::string_view body) {
    board.ask(body);
    board.lines.clear();
    put(whole(body));
    return heard();
  }
  std::string heard() {
    std::string out;
    for (const std::string& line : board.lines) out += (out.empty() ? "" : " | ") + line;
    board.lines.clear();
    return out;
  }
  void pass(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      ++board.now;
      firmware.tick();
      board.check_motion(1);
    }
  }
  // Time in which the host is not silent.
  void pass_with_host(int milliseconds) {
    for (; milliseconds > 0; milliseconds -= 50) {
      pass(std::min(milliseconds, 50));
      say("Q");
    }
  }
  ServoLineState state() {
    const std::string body = say("Q");
    const ServoLineReply reply = parse_servo_reply(body);
    EXPECT_TRUE(std::holds_alternative<ServoLineState>(reply)) << body;
    return std::holds_alternative<ServoLineState>(reply) ? std::get<ServoLineState>(reply) : ServoLineState();
  }
  void ready(std::string_view mask = "7", std::string_view limits = "500 2500 1000 4000") {
    firmware.tick();
    say("H 1 1D2E");
    for (const char channel : std::string("012"))
      ASSERT_EQ(say(std::string("C ") + channel + " " + std::string(limits)), std::string("A C ") + channel);
    ASSERT_EQ(say("E " + std::string(mask)), "A E " + std::string(mask));
  }
  [[nodiscard]] std::int64_t width(std::size_t channel) const { return board.channels[channel].width; }
};

}  // namespace doppel
