// The sketch itself in all its variants, on a stand-in for the Arduino core: it compiles, and its duties are
// the pulses.
#include <gtest/gtest.h>

#include "bench.h"
#include "stub/Arduino.h"
#include "stub/Wire.h"

namespace ledc_core2 {
using namespace stub::core2;
#define ESP_ARDUINO_VERSION_MAJOR 2
#include "../../examples/firmware/doppel_servo/doppel_servo.ino"
#undef ESP_ARDUINO_VERSION_MAJOR
}  // namespace ledc_core2

namespace ledc_core3 {
using namespace stub::core3;
#undef SERVO_HAS_STOP_PIN
#undef SERVO_HAS_VOLTAGE
#undef SERVO_INPUTS
#define SERVO_HAS_STOP_PIN 1
#define SERVO_HAS_VOLTAGE 1
#define SERVO_INPUTS 2
#define ESP_ARDUINO_VERSION_MAJOR 3
#include "../../examples/firmware/doppel_servo/doppel_servo.ino"
}  // namespace ledc_core3

#undef SERVO_USES_PCA9685
#define SERVO_USES_PCA9685 1
namespace pca_core3 {
#include "../../examples/firmware/doppel_servo/doppel_servo.ino"
}  // namespace pca_core3

#undef ESP_ARDUINO_VERSION_MAJOR
#define ESP_ARDUINO_VERSION_MAJOR 2
#undef CONFIG_IDF_TARGET_ESP32
namespace pca_core2 {
#include "../../examples/firmware/doppel_servo/doppel_servo.ino"
}  // namespace pca_core2

#undef SERVO_USES_PCA9685
#define SERVO_USES_PCA9685 0
namespace ledc_core2_s3 {
using namespace stub::core2;
#include "../../examples/firmware/doppel_servo/doppel_servo.ino"
}  // namespace ledc_core2_s3

namespace doppel {
namespace {

class ServoSketch : public testing::Test {
 protected:
  using Function = void (*)();

  void SetUp() override { stub::machine() = stub::Machine(); }

  std::string say(Function loop, std::string_view body) {
    FrameBytes line;
    add_servo_line(body, line);
    stub::machine().received.insert(stub::machine().received.end(), line.bytes().begin(), line.bytes().end());
    stub::machine().sent.clear();
    ++stub::machine().now;
    loop();
    const std::string& sent = stub::machine().sent;
    return sent.size() > 7 ? sent.substr(0, sent.size() - 7) : sent;
  }
  // Ready for targets of channel 0 and 1.
  void start(Function setup, Function loop) {
    setup();
    ++stub::machine().now;
    loop();
    say(loop, "H 1 1");
    EXPECT_EQ(say(loop, "C 0 500 2500 1000 4000"), "A C 0");
    EXPECT_EQ(say(loop, "C 1 500 2500 1000 4000"), "A C 1");
    EXPECT_EQ(say(loop, "E 3"), "A E 3");
  }
  static int pca(int channel) {
    return stub::machine().registers[8 + 4 * channel] | (stub::machine().registers[9 + 4 * channel] << 8);
  }
};

TEST_F(ServoSketch, LedcOfCore2HasPulseIn16Bits) {
  start(ledc_core2::setup, ledc_core2::loop);
  EXPECT_EQ(stub::machine().bits[0], 16);
  EXPECT_EQ(stub::machine().attached[17], 1);
  EXPECT_EQ(stub::machine().duty[0], 0U);
  say(ledc_core2::loop, "P 1 1500 2500");
  EXPECT_EQ(stub::machine().duty[0], 4915U);  // 1500 us of 20 ms, times 65536
  EXPECT_EQ(stub::machine().duty[1], 8192U);
  EXPECT_EQ(say(ledc_core2::loop, "H 1 1"), "I doppel-servo 1 6 1234ABCD 00000001 1.0.0 305");
  say(ledc_core2::loop, "R");
  EXPECT_EQ(stub::machine().duty[0], 0U);
}

TEST_F(ServoSketch, LedcOfCore3IsNamedByPin) {
  stub::machine().millivolts = 1600;  // 5.0 V behind 10 and 4.7 kiloohm
  start(ledc_core3::setup, ledc_core3::loop);
  EXPECT_EQ(stub::machine().bits[17], 16);
  const std::string answer = say(ledc_core3::loop, "P 1 1500 2500");
  EXPECT_EQ(stub::machine().duty[16], 4915U);
  EXPECT_EQ(stub::machine().duty[17], 8192U);
  EXPECT_TRUE(answer.ends_with(" 1 5004 1500 2500 0 0 0 0 a 36 39")) << answer;
  stub::machine().levels[27] = HIGH;  // the stop button is open, or its wire is broken
  ++stub::machine().now;
  stub::machine().sent.clear();
  ledc_core3::loop();
  EXPECT_TRUE(stub::machine().sent.starts_with("! 23 stop pin")) << stub::machine().sent;
}

TEST_F(ServoSketch, LedcOfOtherChipsHas14Bits) {
  stub::machine().millivolts = 1600;
  start(ledc_core2_s3::setup, ledc_core2_s3::loop);
  EXPECT_EQ(stub::machine().bits[0], 14);
  EXPECT_TRUE(say(ledc_core2_s3::loop, "H 1 1").ends_with(" 1220"));
}

TEST_F(ServoSketch, Pca9685HasPrescaleOf50HzAndPulses) {
  for (const auto& [setup, loop] : {std::pair<Function, Function>{pca_core3::setup, pca_core3::loop},
                                    std::pair<Function, Function>{pca_core2::setup, pca_core2::loop}}) {
    stub::machine() = stub::Machine();
    stub::machine().millivolts = 1600;
    start(setup, loop);
    EXPECT_EQ(stub::machine().registers[0xFE], 121);   // 25 MHz / 4096 / 50 Hz - 1
    EXPECT_EQ(stub::machine().registers[0xFD], 0x10);  // all off before anything else
    EXPECT_EQ(stub::machine().registers[0x00], 0x20);  // awake
    EXPECT_EQ(pca(0), 0);                              // never written, so that "all off" holds
    say(loop, "P 1 1500 2500");
    EXPECT_EQ(pca(0), 307);  // 1500 us / 4.88 us
    EXPECT_EQ(pca(1), 512);
    EXPECT_TRUE(say(loop, "H 1 1").ends_with(" 4880"));
    say(loop, "R");
    EXPECT_EQ(pca(0), 0x1000);  // off, whatever the count
  }
}

}  // namespace
}  // namespace doppel
