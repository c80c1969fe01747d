// The lines of the servos' firmware: what each is answered, and what is refused.
#include <fstream>

#include "bench.h"

namespace doppel {
namespace {

TEST_F(ServoFirmware, StartSendsIdentityAndNoPulse) {
  firmware.tick();
  EXPECT_EQ(heard(), "I doppel-servo 1 3 8F3A00C1 00000000 1.0.0 305");
  pass(2000);
  EXPECT_EQ(board.pulses, 0U);
  EXPECT_EQ(heard(), "");
}

TEST_F(ServoFirmware, BootIdDiffersAfterEachStart) {
  firmware.tick();
  doppel_servo::Firmware other(board, configured());
  other.tick();
  EXPECT_NE(firmware.boot(), other.boot());
  EXPECT_NE(other.boot(), 0U);
}

TEST_F(ServoFirmware, BootIdIsNeverZero) {
  board.next_id = 0;
  firmware.tick();
  EXPECT_NE(firmware.boot(), 0U);
}

TEST_F(ServoFirmware, HelloIsAnsweredWithNonce) {
  firmware.tick();
  const ServoLineReply reply = parse_servo_reply(say("H 1 1d2e"));
  ASSERT_TRUE(std::holds_alternative<ServoLineIdentity>(reply));
  const auto& identity = std::get<ServoLineIdentity>(reply);
  EXPECT_EQ(identity.nonce, 0x1D2EU);
  EXPECT_EQ(identity.boot, firmware.boot());
  EXPECT_EQ(identity.channels, 3U);
  EXPECT_EQ(identity.step, 305U);
  EXPECT_EQ(identity.firmware, "1.0.0");
}

TEST_F(ServoFirmware, HelloOfOtherVersionIsRefused) {
  firmware.tick();
  heard();
  EXPECT_EQ(say("H 2 1D2E and what it may add"), "! 1 this firmware speaks version 1");
  EXPECT_EQ(say("C 0 500 2500 1000 4000"), "! 2 no H since the start");
}

TEST_F(ServoFirmware, NothingIsConfiguredBeforeHello) {
  firmware.tick();
  heard();
  EXPECT_EQ(say("C 0 500 2500 1000 4000"), "! 2 no H since the start");
  EXPECT_EQ(say("W 200 hold"), "! 2 no H since the start");
  EXPECT_EQ(say("E 0"), "! 2 no H since the start");
  EXPECT_EQ(say("P 1 1500"), "T 1 1000 0 0 0 0 0 a 0 0");
}

TEST_F(ServoFirmware, LinesAreAnsweredAsDocumented) {
  firmware.tick();
  say("H 1 1");
  EXPECT_EQ(say("C 0 500 2500 1000 4000"), "A C 0");
  EXPECT_EQ(say("W 250 relax"), "A W");
  EXPECT_EQ(say("W 250 hold"), "A W");
  EXPECT_EQ(say("E 1"), "A E 1");
  EXPECT_EQ(say("Q"), "T 0 1000 1 0 0 0 0 a 0 0");
  EXPECT_EQ(say("P 17 1500"), "T 17 1000 1 0 1500 0 0 a 0 0");
  EXPECT_EQ(say("Q"), "T 17 1000 1 0 1500 0 0 a 0 0");
  EXPECT_EQ(say("S"), "A S");
  EXPECT_EQ(say("R"), "A R");
  EXPECT_EQ(say("Q"), "T 17 1000 0 0 0 0 0 a 0 0");
}

TEST_F(ServoFirmware, StateHasVoltageAndAnalogInputs) {
  board.supply = 5012;
  board.inputs = {512, 4095};
  firmware.tick();
  const ServoLineState read = state();
  EXPECT_EQ(read.millivolts, 5012U);
  EXPECT_EQ(read.channels, 3U);
  ASSERT_EQ(read.inputs, 2U);
  EXPECT_EQ(read.analog[0], 512);
  EXPECT_EQ(read.analog[1], 4095);
}

TEST_F(ServoFirmware, LineWithWrongCheckIsDroppedAndCounted) {
  ready();
  std::string line = whole("P 1 1500 1500 1500");
  line[5] = '9';
  board.lines.clear();
  put(line);
  EXPECT_EQ(heard(), "");
  EXPECT_EQ(board.pulses, 0U);
  EXPECT_EQ(firmware.dropped_lines(), 1U);
}

TEST_F(ServoFirmware, EachDamagedByteDropsLine) {
  ready();
  const std::string line = whole("P 1 1500 1500 1500");
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = line;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
      board.lines.clear();
      put(damaged);
      ASSERT_EQ(heard(), "") << damaged;
    }
  }
  EXPECT_EQ(board.pulses, 0U);
  put(line);
  EXPECT_EQ(board.pulses, 3U);
}

TEST_F(ServoFirmware, DroppedLinesAreReportedOncePerSecond) {
  ready("1");
  pass_with_host(1000);
  heard();
  put("x\ny\n");
  pass(1);
  EXPECT_EQ(heard(), "! 24 damaged lines since the start: 2");
  put("z\n");
  pass(200);
  say("Q");
  heard();
  pass(200);
  EXPECT_EQ(heard(), "");
  say("Q");
  pass_with_host(599);
  put("z\n");
  pass(2);
  EXPECT_EQ(heard(), "! 24 damaged lines since the start: 4");
}

TEST_F(ServoFirmware, LineLongerThanMaximumIsDropped) {
  firmware.tick();
  heard();
  const std::string longest = whole("Q" + std::string(120, ' '));
  ASSERT_EQ(longest.size(), 128U);
  put(longest);
  EXPECT_EQ(heard(), "! 3 S, R and Q are alone in their line");
  put(whole("Q" + std::string(121, ' ')));
  EXPECT_EQ(heard(), "");
  put(std::string(5000, 'x') + "\n" + whole("Q"));
  EXPECT_EQ(heard(), "T 0 1000 0 0 0 0 0 a 0 0");
  EXPECT_EQ(firmware.dropped_lines(), 2U);
}

TEST_F(ServoFirmware, EmptyLineAndCarriageReturnAreNoDamage) {
  firmware.tick();
  heard();
  put("\n\r\n");
  std::string line = whole("Q");
  line.insert(line.size() - 1, "\r");
  put(line);
  EXPECT_EQ(heard(), "T 0 1000 0 0 0 0 0 a 0 0");
  EXPECT_EQ(firmware.dropped_lines(), 0U);
}

TEST_F(ServoFirmware, WordThatIsNoNumberIsRefusedAndChangesNothing) {
  ready("1");
  ASSERT_EQ(say("P 5 1500"), "T 5 1000 1 0 1500 0 0 a 0 0");
  for (const char* const body : {"P",
                                 "P ",
                                 "P x",
                                 "P 6 ",
                                 "P 6 x",
                                 "P 6 -1500",
                                 "P 6 +1500",
                                 "P 6 1600x",
                                 "P 6 1600  1600",
                                 "P 6 1600 ",
                                 "P 6 0",
                                 "P 6 1600 0",
                                 "P 6 16.5",
                                 "P 6 0x640",
                                 "P 6 4294967296",
                                 "P 6 1600 99999999999999999999",
                                 "P 4294967296 1600",
                                 "P 6 -- 1600",
                                 "E",
                                 "E x",
                                 "E 1 1",
                                 "E -1",
                                 "W 300",
                                 "W 300 stay",
                                 "W hold",
                                 "W 300 hold relax",
                                 "C 0",
                                 "C 0 500 2500 1000",
                                 "C 0 500 2500 1000 4000 1",
                                 "C x 500 2500 1000 4000",
                                 "H",
                                 "H 1",
                                 "H 1 x",
                                 "H 1 123456789",
                                 "H x 1",
                                 "S 1",
                                 "R 0",
                                 "Q ",
                                 "Z",
                                 "p 6 1600",
                                 "PP 6 1600",
                                 " P 6 1600",
                                 "P\t6 1600"}) {
    const std::string answer = say(body);
    EXPECT_TRUE(answer.starts_with("! 3 ")) << body << ": " << answer;
  }
  EXPECT_EQ(say("Q"), "T 5 1000 1 0 1500 0 0 a 0 0");
  EXPECT_EQ(firmware.enabled_mask(), 1U);
}

TEST_F(ServoFirmware, NumberOutsideRangeIsRefused) {
  firmware.tick();
  say("H 1 1");
  for (const char* const body :
       {"C 3 500 2500 1000 4000", "C 0 299 2500 1000 4000", "C 0 500 3001 1000 4000",
        "C 0 1500 1500 1000 4000", "C 0 2500 500 1000 4000", "C 0 500 2500 0 4000",
        "C 0 500 2500 100001 4000", "C 0 500 2500 1000 0", "C 0 500 2500 1000 10000001", "W 19 hold",
        "W 10001 hold", "W 0 hold", "E 8", "E 4294967295", "P 1 1500 1500 1500 1500"}) {
    const std::string answer = say(body);
    EXPECT_TRUE(answer.starts_with("! 4 ")) << body << ": " << answer;
  }
  EXPECT_EQ(say("E 1"), "! 5 no C for channel 0");
}

TEST_F(ServoFirmware, FaultsAndAnswersAreReadByHost) {
  firmware.tick();
  ASSERT_TRUE(std::holds_alternative<ServoLineFault>(parse_servo_reply(say("E 1"))));
  say("H 1 1");
  ASSERT_TRUE(std::holds_alternative<ServoLineAnswer>(parse_servo_reply(say("C 0 500 2500 1000 4000"))));
  ASSERT_TRUE(std::holds_alternative<ServoLineAnswer>(parse_servo_reply(say("E 1"))));
  ASSERT_TRUE(std::holds_alternative<ServoLineState>(parse_servo_reply(say("P 1 -"))));
  const auto stopped = std::get<ServoLineAnswer>(parse_servo_reply(say("S")));
  EXPECT_EQ(stopped.command, 'S');
  EXPECT_FALSE(stopped.value);
  const auto refused = std::get<ServoLineFault>(parse_servo_reply(say("E 2")));
  EXPECT_EQ(refused.code, doppel_servo::kNoLimits);
}

TEST_F(ServoFirmware, LongestStateFitsIntoLine) {
  for (int channels = 1; channels <= doppel_servo::kMaxChannels; ++channels) {
    WatchedBoard wide;
    wide.now = 4294967290U;
    wide.supply = 100000;
    wide.inputs.fill(65535);
    doppel_servo::Config settings;
    settings.channels = static_cast<std::uint8_t>(channels);
    settings.inputs = doppel_servo::kMaxInputs;
    doppel_servo::Firmware wide_firmware(wide, settings);
    const auto tell = [&](const std::string& body) {
      wide.ask(body);
      for (const char byte : whole(body)) wide_firmware.receive(static_cast<std::uint8_t>(byte));
    };
    tell("H 1 FFFFFFFF");
    std::string targets = "P 4294967295";
    for (int i = 0; i < channels; ++i) {
      tell("C " + std::to_string(i) + " 1000 3000 1 1");
      targets += " 2999";
    }
    tell("E " + std::to_string((1U << channels) - 1));
    tell(targets);
    const ServoLineReply reply = parse_servo_reply(wide.lines.back());
    ASSERT_TRUE(std::holds_alternative<ServoLineState>(reply)) << wide.lines.back();
    const auto& read = std::get<ServoLineState>(reply);
    EXPECT_EQ(read.channels, static_cast<std::size_t>(channels));
    EXPECT_EQ(read.inputs, doppel_servo::Firmware::inputs_with(settings.channels));
    EXPECT_GE(read.inputs, 1U);
    EXPECT_EQ(wide.violation, "");
  }
}

// The session of docs/servo_line.md: "> " is the host, "< " the board, "wait N ms" is silence.
TEST_F(ServoFirmware, SessionOfPageRunsAsWritten) {
  std::ifstream page(DOPPEL_SOURCE_DIR "/docs/servo_line.md");
  doppel_servo::Config settings = configured();
  settings.inputs = 0;
  board.supply = 5012;
  doppel_servo::Firmware session(board, settings);
  session.tick();
  std::string line;
  while (std::getline(page, line) && line != "```session") {
  }
  int answers = 0;
  while (std::getline(page, line) && line != "```") {
    if (line.starts_with("< ")) {
      ASSERT_FALSE(board.lines.empty()) << line;
      EXPECT_EQ(board.lines.front(), line.substr(2));
      board.lines.erase(board.lines.begin());
      ++answers;
      continue;
    }
    EXPECT_TRUE(board.lines.empty()) << board.lines.front();
    if (line.starts_with("> ")) {
      board.ask(line.substr(2));
      for (const char byte : whole(line.substr(2))) session.receive(static_cast<std::uint8_t>(byte));
    } else {
      ASSERT_TRUE(line.starts_with("wait ")) << line;
      for (int i = std::stoi(line.substr(5)); i > 0; --i) {
        ++board.now;
        session.tick();
        board.check_motion(1);
      }
    }
  }
  EXPECT_GT(answers, 10);
}

TEST_F(ServoFirmware, CheckIsThatOfHost) {
  EXPECT_EQ(doppel_servo::crc16("123456789", 9), 0x29B1);  // the check value of CRC-16/CCITT-FALSE
  const std::string body = "P 17 1500 1500 1500 1500 1500 1500";
  EXPECT_EQ(doppel_servo::crc16(body.data(), body.size()), 0xD587);
}

}  // namespace
}  // namespace doppel
