// Hobby PWM servos on an ESP32 as doppel's servo line (docs/servo_line.md). This file has the pins and the
// port; the behaviour is in doppel_servo.h. Flashing and wiring: docs/servo_firmware.md. Nothing here is a
// safety function.
//
// Edit the numbers down to PCA_OSCILLATOR, and nothing else.
#ifndef SERVO_USES_PCA9685
#define SERVO_USES_PCA9685 0  // 0: the ESP32's own PWM (LEDC), 0.03 degrees; 1: a PCA9685 on I2C, 0.44
#endif
#ifndef SERVO_HAS_STOP_PIN
#define SERVO_HAS_STOP_PIN 0  // 1: a button that opens when it is pressed, between STOP_PIN and ground
#endif
#ifndef SERVO_HAS_VOLTAGE
#define SERVO_HAS_VOLTAGE 0  // 1: a divider from the servos' supply to VOLTAGE_PIN
#endif
#ifndef SERVO_INPUTS
#define SERVO_INPUTS 0  // analog inputs that are wired, of ANALOG_PINS, from the first on
#endif

#include <Arduino.h>
#if SERVO_USES_PCA9685
#include <Wire.h>
#endif

#include "doppel_servo.h"

namespace {

constexpr uint32_t BAUD = 115200;  // 921600 works over short cables with most adapters
constexpr uint8_t CHANNELS = 6;
// No pins that have a pulse or a level while an ESP32 starts (0, 1, 2, 3, 5, 12, 14, 15).
constexpr uint8_t SERVO_PINS[] = {16, 17, 18, 19, 23, 25};     // LEDC: of channel 0, 1, ...
constexpr uint8_t ANALOG_PINS[] = {36, 39, 34, 35, 32};
constexpr uint8_t STOP_PIN = 27;
constexpr uint8_t VOLTAGE_PIN = 33;
constexpr int32_t DIVIDER_TOP = 10000, DIVIDER_BOTTOM = 4700;  // ohm: 6.0 V becomes 1.92 V
constexpr int32_t BROWN_OUT_MV = 4300;
constexpr uint8_t PCA_SDA = 21, PCA_SCL = 22, PCA_ADDRESS = 0x40;
constexpr uint32_t PCA_OSCILLATOR = 25000000;  // Hz; correct it by a measured pulse: chips differ by 5 %

constexpr uint32_t FRAME_HZ = 50;
#if SERVO_USES_PCA9685
// The PCA9685 divides a period into 4096 steps of PRESCALE + 1 beats of its oscillator.
constexpr uint32_t PRESCALE = (PCA_OSCILLATOR + 2048 * FRAME_HZ) / (4096 * FRAME_HZ) - 1;  // 121
constexpr uint32_t STEP_NS = static_cast<uint32_t>((PRESCALE + 1) * 1000000000ULL / PCA_OSCILLATOR);
#else
#if CONFIG_IDF_TARGET_ESP32
constexpr uint8_t PWM_BITS = 16;
#else
constexpr uint8_t PWM_BITS = 14;  // ESP32-S2, S3, C3, C6: their timers have no more
#endif
constexpr uint32_t STEP_NS = (1000000000UL / FRAME_HZ) >> PWM_BITS;
static_assert(sizeof(SERVO_PINS) >= CHANNELS, "a pin for each channel");
#endif
static_assert(sizeof(ANALOG_PINS) >= SERVO_INPUTS, "a pin for each analog input");

class ServoBoard final : public doppel_servo::Board {
 public:
  void begin() {
#if SERVO_USES_PCA9685
    Wire.begin(PCA_SDA, PCA_SCL);
    Wire.setClock(400000);
    write({0xFD, 0x10});  // all channels off: it may still send pulses from before a reset
    write({0x00, 0x30});  // asleep, or the prescaler is read-only
    write({0xFE, static_cast<uint8_t>(PRESCALE)});
    write({0x00, 0x20});  // awake; register addresses count up by themselves
    delay(1);             // its oscillator starts in 0.5 ms
#else
    for (uint8_t i = 0; i < CHANNELS; ++i) {
#if ESP_ARDUINO_VERSION_MAJOR >= 3
      ledcAttach(SERVO_PINS[i], FRAME_HZ, PWM_BITS);
#else
      ledcSetup(i, FRAME_HZ, PWM_BITS);
      ledcAttachPin(SERVO_PINS[i], i);
#endif
    }
#endif
    if (SERVO_HAS_STOP_PIN) pinMode(STOP_PIN, INPUT_PULLUP);
  }

  uint32_t milliseconds() override { return millis(); }
  uint32_t random_id() override { return esp_random(); }
  uint16_t analog(uint8_t input) override { return static_cast<uint16_t>(analogRead(ANALOG_PINS[input])); }
  // A broken wire stops too.
  bool stop_pin() override { return SERVO_HAS_STOP_PIN && digitalRead(STOP_PIN) == HIGH; }
  int32_t millivolts() override {
    if (!SERVO_HAS_VOLTAGE) return -1;
    const int32_t divided = static_cast<int32_t>(analogReadMilliVolts(VOLTAGE_PIN));
    return divided * (DIVIDER_TOP + DIVIDER_BOTTOM) / DIVIDER_BOTTOM;
  }
  void send(const char* bytes, size_t size) override {
    Serial.write(reinterpret_cast<const uint8_t*>(bytes), size);
  }

#if SERVO_USES_PCA9685
  void pulse(uint8_t channel, uint32_t nanoseconds) override {
    const uint32_t steps = (nanoseconds + STEP_NS / 2) / STEP_NS;
    if (steps == steps_[channel]) return;
    steps_[channel] = static_cast<uint16_t>(steps);
    const uint8_t off = steps == 0 ? 0x10 : static_cast<uint8_t>(steps >> 8);
    write({static_cast<uint8_t>(0x06 + 4 * channel), 0, 0, static_cast<uint8_t>(steps & 0xFF), off});
  }

 private:
  template <size_t Size>
  void write(const uint8_t (&bytes)[Size]) {
    Wire.beginTransmission(PCA_ADDRESS);
    Wire.write(bytes, Size);
    Wire.endTransmission();
  }

  uint16_t steps_[CHANNELS] = {};
#else
  void pulse(uint8_t channel, uint32_t nanoseconds) override {
    constexpr uint64_t frame_ns = 1000000000ULL / FRAME_HZ;
    const uint64_t scaled = static_cast<uint64_t>(nanoseconds) << PWM_BITS;
    const uint32_t duty = static_cast<uint32_t>((scaled + frame_ns / 2) / frame_ns);
#if ESP_ARDUINO_VERSION_MAJOR >= 3
    ledcWrite(SERVO_PINS[channel], duty);
#else
    ledcWrite(channel, duty);
#endif
  }
#endif
};

doppel_servo::Config config() {
  doppel_servo::Config out;
  out.channels = CHANNELS;
  out.inputs = SERVO_INPUTS;
  out.step_ns = STEP_NS;
  out.brown_out_mv = BROWN_OUT_MV;
  out.pulse_period_ms = SERVO_USES_PCA9685 ? 5 : 1;  // six writes over I2C take 0.8 ms
  return out;
}

ServoBoard board;
doppel_servo::Firmware firmware(board, config());

}  // namespace

void setup() {
  board.begin();
  Serial.begin(BAUD);
}

void loop() {
  while (Serial.available() > 0) firmware.receive(static_cast<uint8_t>(Serial.read()));
  firmware.tick();
}
