// Fuzz target: LeRobot's calibration of an arm.
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/calibration/lerobot.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(
        doppel::parse_lerobot_calibration({reinterpret_cast<const char*>(data), size}, "fuzz.json"));
  } catch (const doppel::InputError&) {
  }
  return 0;
}
