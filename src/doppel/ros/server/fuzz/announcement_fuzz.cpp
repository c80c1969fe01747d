// Fuzz target: the announcement of a twin, which another program of this user can write.
#include <cstdint>
#include <cstdlib>

#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/ros/server/detail/announcement_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto twin = doppel::read_announcement(doppel::fuzz_file("1-1.json", data, size));
  if (!twin) return 0;
  if (twin->pid <= 0 || twin->port == 0) std::abort();
  static_cast<void>(twin->label());
  return 0;
}
