// Frames against the makers' worked examples, against damage, and against noise around them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "doppel/devices/frames/checksums.h"
#include "doppel/devices/frames/dynamixel_frame.h"
#include "doppel/devices/frames/feetech_frame.h"
#include "doppel/devices/frames/servo_line.h"

namespace doppel {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::ElementsAre;

Bytes of_hex(const std::string& text) {
  Bytes out;
  for (std::size_t i = 0; i < text.size(); i += 3)
    out.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return out;
}

Bytes bytes_in(std::string_view text) {
  return {text.begin(), text.end()};
}

Bytes bytes_in(const FrameBytes& frame) {
  return {frame.bytes().begin(), frame.bytes().end()};
}

Bytes feetech(std::uint8_t id, std::uint8_t code, const Bytes& parameters) {
  FrameBytes out;
  add_feetech_frame({id, code, parameters}, out);
  return bytes_in(out);
}

Bytes dynamixel(std::uint8_t id, std::uint8_t instruction, const Bytes& parameters) {
  FrameBytes out;
  add_dynamixel_frame({id, instruction, parameters}, out);
  return bytes_in(out);
}

Bytes line(std::string_view body) {
  FrameBytes out;
  add_servo_line(body, out);
  return bytes_in(out);
}

template <typename Reader>
void push_all(Reader& reader, const Bytes& bytes) {
  ASSERT_EQ(reader.push(bytes), bytes.size());
}

template <typename Reader>
std::size_t frames_in(const Bytes& bytes) {
  Reader reader;
  std::size_t frames = 0;
  for (std::size_t pushed = 0; pushed < bytes.size();) {
    pushed += reader.push(std::span(bytes).subspan(pushed));
    while (reader.next()) ++frames;
  }
  return frames;
}

bool has_whole(const Bytes& bytes, const Bytes& frame) {
  return std::search(bytes.begin(), bytes.end(), frame.begin(), frame.end()) != bytes.end();
}

// A single flipped bit, a lost byte, a doubled byte, a burst.
Bytes damaged(Bytes bytes, std::mt19937_64& random) {
  const auto index = [&] { return static_cast<std::ptrdiff_t>(random() % bytes.size()); };
  switch (random() % 4) {
    case 0:
      bytes[static_cast<std::size_t>(index())] ^= static_cast<std::uint8_t>(1U << (random() % 8));
      break;
    case 1:
      bytes.erase(bytes.begin() + index());
      break;
    case 2: {
      const auto i = index();
      bytes.insert(bytes.begin() + i, bytes[static_cast<std::size_t>(i)]);
      break;
    }
    default: {
      const auto begin = static_cast<std::size_t>(index());
      for (std::size_t i = begin; i < std::min(begin + 4, bytes.size()); ++i)
        bytes[i] = static_cast<std::uint8_t>(random());
    }
  }
  return bytes;
}

TEST(FeetechFrame, MakersExamplesAreMadeByteForByte) {
  EXPECT_EQ(feetech(1, 0x01, {}), of_hex("FF FF 01 02 01 FB"));
  EXPECT_EQ(feetech(1, 0x02, {0x38, 0x02}), of_hex("FF FF 01 04 02 38 02 BE"));
  EXPECT_EQ(feetech(1, 0x00, {0x18, 0x05}), of_hex("FF FF 01 04 00 18 05 DD"));
  EXPECT_EQ(feetech(0xFE, 0x82, {0x38, 0x06, 1, 2}), of_hex("FF FF FE 06 82 38 06 01 02 38"));
}

TEST(FeetechFrame, FrameAmongNoiseIsFound) {
  FeetechReader reader;
  push_all(reader, of_hex("00 FF 12 FF FF FF FF 01 04 00 18 05 DD 42 FF"));
  const auto frame = reader.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->id, 1);
  EXPECT_THAT(frame->parameters, ElementsAre(0x18, 0x05));
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.counts().noise, 6U);
}

TEST(FeetechFrame, FrameInSinglePiecesIsFound) {
  FeetechReader reader;
  for (const std::uint8_t byte : feetech(3, 0x20, {1, 2, 3})) {
    EXPECT_FALSE(reader.next());
    push_all(reader, {byte});
  }
  const auto frame = reader.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->code, 0x20);
}

TEST(FeetechFrame, WrongSumIsCountedAndNextFrameIsFound) {
  Bytes bytes = feetech(1, 0, {0x18, 0x05});
  bytes[5] ^= 0x10;
  const Bytes good = feetech(2, 0, {0x18, 0x05});
  bytes.insert(bytes.end(), good.begin(), good.end());
  FeetechReader reader;
  push_all(reader, bytes);
  const auto frame = reader.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->id, 2);
  EXPECT_EQ(reader.counts().bad_checks, 1U);
}

TEST(DynamixelFrame, MakersExamplesAreMadeByteForByte) {
  EXPECT_EQ(dynamixel(1, 0x01, {}), of_hex("FF FF FD 00 01 03 00 01 19 4E"));
  EXPECT_EQ(dynamixel(0xFE, 0x01, {}), of_hex("FF FF FD 00 FE 03 00 01 31 42"));
  EXPECT_EQ(dynamixel(1, 0x55, {0x00, 0x06, 0x04, 0x26}),
            of_hex("FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"));
  EXPECT_EQ(dynamixel(1, 0x02, {0x84, 0x00, 0x04, 0x00}),
            of_hex("FF FF FD 00 01 07 00 02 84 00 04 00 1D 15"));
  EXPECT_EQ(dynamixel(1, 0x55, {0x00, 0xA6, 0x00, 0x00, 0x00}),
            of_hex("FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0"));
  EXPECT_EQ(dynamixel(1, 0x03, {0x74, 0x00, 0x00, 0x02, 0x00, 0x00}),
            of_hex("FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89"));
  EXPECT_EQ(dynamixel(1, 0x08, {}), of_hex("FF FF FD 00 01 03 00 08 2F 4E"));
  EXPECT_EQ(dynamixel(0xFE, 0x82, {0x84, 0x00, 0x04, 0x00, 0x01, 0x02}),
            of_hex("FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA"));
}

TEST(DynamixelFrame, PatternOfHeaderIsStuffedAndComesBack) {
  const Bytes parameters{0x00, 0xFF, 0xFF, 0xFD, 0x00, 0xFF, 0xFF, 0xFD, 0xFD, 0xFF, 0xFF, 0xFD};
  const Bytes frame = dynamixel(7, 0x55, parameters);
  EXPECT_EQ(frame.size(), 10 + parameters.size() + 3);
  DynamixelReader reader;
  push_all(reader, frame);
  const auto read = reader.next();
  ASSERT_TRUE(read);
  EXPECT_EQ(Bytes(read->parameters.begin(), read->parameters.end()), parameters);
}

TEST(DynamixelFrame, HeaderInsideFrameIsNoFrame) {
  // A frame that was cut off, and a whole one after it, whose bytes the first one's length covers.
  Bytes bytes = dynamixel(1, 0x55, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  bytes.resize(10);
  const Bytes good = dynamixel(2, 0x55, {0, 9});
  bytes.insert(bytes.end(), good.begin(), good.end());
  bytes.resize(bytes.size() + 8, 0);
  DynamixelReader reader;
  push_all(reader, bytes);
  const auto frame = reader.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->id, 2);
}

TEST(DynamixelFrame, FastAnswerHasPartOfEachServo) {
  // Each servo adds its error bits, id and data, and the CRC of all before, but the last, whose CRC is the
  // frame's.
  Bytes all = of_hex("FF FF FD 00 FE 00 00 55");
  const Bytes data[2] = {{0xFF, 0xFF, 0xFD, 0x07}, {1, 2, 3, 4}};
  const std::size_t part = 8;
  all[5] = static_cast<std::uint8_t>(1 + 2 * part);
  for (int servo = 0; servo < 2; ++servo) {
    all.push_back(servo == 1 ? 0x80 : 0);
    all.push_back(static_cast<std::uint8_t>(3 + servo));
    all.insert(all.end(), data[servo].begin(), data[servo].end());
    const std::uint16_t crc = dynamixel_crc(all);
    all.push_back(static_cast<std::uint8_t>(crc & 0xFF));
    all.push_back(static_cast<std::uint8_t>(crc >> 8));
  }
  FrameBytes frame;
  add_fast_answer(std::span(all).subspan(8, all.size() - 10), frame);
  EXPECT_EQ(bytes_in(frame), all);
  DynamixelReader reader;
  push_all(reader, all);
  ASSERT_TRUE(reader.next());
  for (std::size_t servo = 0; servo < 2; ++servo) {
    const auto found = reader.fast_part(servo, 4);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->id, 3 + servo);
    EXPECT_EQ(found->error, servo == 1 ? 0x80 : 0);
    EXPECT_EQ(Bytes(found->data.begin(), found->data.end()), data[servo]);
  }
  EXPECT_FALSE(reader.fast_part(2, 4));
}

TEST(ServoLine, TargetsAreGoldenBytes) {
  const std::vector<std::uint16_t> targets(6, 1500);
  FrameBytes out;
  add_servo_targets(17, targets, out);
  EXPECT_EQ(bytes_in(out), bytes_in("P 17 1500 1500 1500 1500 1500 1500 *D587\n"));
}

TEST(ServoLine, TargetOfZeroKeepsChannel) {
  FrameBytes out;
  add_servo_targets(1, std::vector<std::uint16_t>{900, 0}, out);
  EXPECT_EQ(bytes_in(out), line("P 1 900 -"));
}

TEST(ServoLine, StateIsRead) {
  ServoLineReader reader;
  push_all(reader, line("T 17 123456 3 5012 1500 0 2500 a 512 4095"));
  const auto body = reader.next();
  ASSERT_TRUE(body);
  const auto reply = parse_servo_reply(*body);
  const auto* const state = std::get_if<ServoLineState>(&reply);
  ASSERT_NE(state, nullptr);
  EXPECT_EQ(state->sequence, 17U);
  EXPECT_EQ(state->millivolts, 5012U);
  EXPECT_EQ(state->flags, ServoLineState::kEnabled | ServoLineState::kRamping);
  ASSERT_EQ(state->channels, 3U);
  EXPECT_EQ(state->pulses[2], 2500);
  ASSERT_EQ(state->inputs, 2U);
  EXPECT_EQ(state->analog[1], 4095);
}

TEST(ServoLine, IdentityAnswerAndFaultAreRead) {
  const auto identity = parse_servo_reply("I doppel-servo 1 6 8F3A00C1 1D2E 1.0.0 61");
  ASSERT_TRUE(std::holds_alternative<ServoLineIdentity>(identity));
  EXPECT_EQ(std::get<ServoLineIdentity>(identity).boot, 0x8F3A00C1U);
  EXPECT_EQ(std::get<ServoLineIdentity>(identity).step, 61U);
  const auto answer = parse_servo_reply("A C 3");
  ASSERT_TRUE(std::holds_alternative<ServoLineAnswer>(answer));
  EXPECT_EQ(std::get<ServoLineAnswer>(answer).value, 3U);
  const auto fault = parse_servo_reply("! 4 brown-out at 4310 mV");
  ASSERT_TRUE(std::holds_alternative<ServoLineFault>(fault));
  EXPECT_EQ(std::get<ServoLineFault>(fault).text, "brown-out at 4310 mV");
}

TEST(ServoLine, WordThatIsNoNumberMakesNoReply) {
  for (const char* const body :
       {"T 1 2 3 4", "T 1 2 3 4 x", "T 1 2 3 4 1500 a 1 x", "T 1 2 3 4 99999", "T  2 3 4 1500",
        "I doppel-servo 1 99 0 0 1.0 61", "A", "A CC", "A C x", "! x", "", "Z"}) {
    EXPECT_TRUE(std::holds_alternative<std::monostate>(parse_servo_reply(body))) << body;
  }
}

TEST(ServoLine, LineThatIsTooLongIsNoiseAndNextIsFound) {
  Bytes bytes(700, 'x');
  bytes.push_back('\n');
  const Bytes good = line("A W");
  bytes.insert(bytes.end(), good.begin(), good.end());
  ServoLineReader reader;
  std::optional<std::string_view> found;
  for (std::size_t pushed = 0; pushed < bytes.size() && !found;) {
    pushed += reader.push(std::span(bytes).subspan(pushed, std::min<std::size_t>(50, bytes.size() - pushed)));
    found = reader.next();
  }
  ASSERT_TRUE(found);
  EXPECT_EQ(*found, "A W");
  EXPECT_GE(reader.counts().noise, 700U);
}

// Frames of random contents come back whole, whatever their pieces and the noise between them.
TEST(Frames, RandomFramesComeBack) {
  const std::uint64_t seed = 20261128;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  FeetechReader feetech_reader;
  DynamixelReader dynamixel_reader;
  for (int i = 0; i < 20000; ++i) {
    Bytes parameters(random() % 40);
    // Few values, so that headers and stuffing appear.
    for (std::uint8_t& byte : parameters)
      byte = std::array<std::uint8_t, 4>{0xFF, 0xFD, 0x00, 0x55}[random() % 4];
    const auto id = static_cast<std::uint8_t>(random() % 253), code = static_cast<std::uint8_t>(random());
    push_all(feetech_reader, feetech(id, code, parameters));
    const auto first = feetech_reader.next();
    ASSERT_TRUE(first);
    ASSERT_EQ(Bytes(first->parameters.begin(), first->parameters.end()), parameters);
    push_all(dynamixel_reader, dynamixel(id, code, parameters));
    const auto second = dynamixel_reader.next();
    ASSERT_TRUE(second) << i;
    ASSERT_EQ(Bytes(second->parameters.begin(), second->parameters.end()), parameters);
  }
}

// A damaged frame that is taken has a check that matches by chance: one of 256 for a sum, one of 65536 for
// a CRC.
TEST(Frames, DamagedFramesAreRefused) {
  const std::uint64_t seed = 4;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  const Bytes sts = feetech(1, 0, {0x18, 0x05, 0x20, 0x03, 0x10, 0x00});
  const Bytes xl = dynamixel(1, 0x55, {0x00, 0x10, 0x00, 0x20, 0x00, 0x00, 0x00, 0x00, 0x08, 0x00, 0x00});
  const Bytes text = line("T 17 123456 3 5012 1500 1500 1500 1500 1500 1500");
  constexpr int kTries = 200000;
  int taken_sts = 0, taken_xl = 0, taken_text = 0;
  for (int i = 0; i < kTries; ++i) {
    const Bytes a = damaged(sts, random), b = damaged(xl, random), c = damaged(text, random);
    if (!has_whole(a, sts)) taken_sts += frames_in<FeetechReader>(a) > 0 ? 1 : 0;
    if (!has_whole(b, xl)) taken_xl += frames_in<DynamixelReader>(b) > 0 ? 1 : 0;
    if (!has_whole(c, text)) taken_text += frames_in<ServoLineReader>(c) > 0 ? 1 : 0;
  }
  EXPECT_LT(taken_sts, kTries / 100);
  EXPECT_LT(taken_xl, kTries / 5000);
  EXPECT_LT(taken_text, kTries / 5000);
}

// The length of a Feetech frame is one byte: one parameter more would be read as another frame.
TEST(Frames, PartsThatDoNotFitAreRefusedWithTheirSizes) {
  FrameBytes out;
  const Bytes many(kDynamixelMaxParameters + 1);
  const auto refusal_of = [&](auto add) -> std::string {
    out.clear();
    try {
      add();
    } catch (const std::length_error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal_of([&] { add_feetech_frame({1, 3, std::span(many).first(253)}, out); }), "accepted");
  EXPECT_THAT(refusal_of([&] {
                add_feetech_frame({1, 3, std::span(many).first(254)}, out);
              }),
              testing::AllOf(testing::HasSubstr("254"), testing::HasSubstr("253")));
  EXPECT_EQ(refusal_of([&] { add_dynamixel_frame({1, 3, std::span(many).first(900)}, out); }), "accepted");
  EXPECT_THAT(refusal_of([&] {
                add_dynamixel_frame({1, 3, many}, out);
              }),
              testing::AllOf(testing::HasSubstr("901"), testing::HasSubstr("900")));
  EXPECT_THAT(refusal_of([&] {
                while (true) out.add(many);
              }),
              testing::HasSubstr("2048"));
}

}  // namespace
}  // namespace doppel
