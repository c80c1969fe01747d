// The sketch as the Arduino core 2.x compiles it: as C++11. sketch_test.cpp runs it.
#include "../../examples/firmware/doppel_servo/doppel_servo.h"
#include "stub/Arduino.h"
#include "stub/Wire.h"

#define ESP_ARDUINO_VERSION_MAJOR 2
#define SERVO_HAS_STOP_PIN 1
#define SERVO_HAS_VOLTAGE 1
#define SERVO_INPUTS 5

namespace ledc {
using namespace stub::core2;
void setup();
void loop();
#include "../../examples/firmware/doppel_servo/doppel_servo.ino"
}  // namespace ledc

#undef SERVO_USES_PCA9685
#define SERVO_USES_PCA9685 1
namespace pca {
void setup();
void loop();
#include "../../examples/firmware/doppel_servo/doppel_servo.ino"
}  // namespace pca
