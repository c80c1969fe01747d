// Fuzz target: a parameter file of ROS 2.
#include <cstdint>

#include "doppel/ros/bus/parameter_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto file = doppel::ParameterFile::parse({reinterpret_cast<const char*>(data), size}, "fuzz.yaml");
    static_cast<void>(file.overrides_for("/arm/controller_manager", "controller_manager").children("arm"));
  } catch (const doppel::InputError&) {
  }
  return 0;
}
