// The firmware as a board compiles it: C++11, without exceptions, RTTI and floating point.
// tests/firmware_object_test looks at what this object refers to.
#include "../../examples/firmware/doppel_servo/doppel_servo.h"

#if __cplusplus != 201103L || defined(__EXCEPTIONS) || defined(__GXX_RTTI)
#error "compile it with -std=c++11 -fno-exceptions -fno-rtti"
#endif

void run_servo_firmware(doppel_servo::Firmware& firmware, const uint8_t* bytes, size_t size);

void run_servo_firmware(doppel_servo::Firmware& firmware, const uint8_t* bytes, size_t size) {
  for (size_t i = 0; i < size; ++i) firmware.receive(bytes[i]);
  firmware.tick();
}
