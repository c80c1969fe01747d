// Fuzz target: the announcement of a twin, which another program of this user can write.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>

#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/ros/server/announcement.h"

namespace {

std::filesystem::path own_folder() {
  setenv("XDG_RUNTIME_DIR", doppel::fuzz_folder().c_str(), 1);
  std::filesystem::create_directories(doppel::announcement_folder());
  std::filesystem::permissions(doppel::announcement_folder(), std::filesystem::perms::owner_all);
  return doppel::announcement_folder();
}

}  // namespace

// The input begins behind the number of the process, which is alive.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = own_folder();
  const std::string text =
      "{\"pid\": " + std::to_string(getpid()) + ", " + std::string(reinterpret_cast<const char*>(data), size);
  std::ofstream(folder / "1-1.json") << text;
  for (const doppel::RunningTwin& twin : doppel::find_running()) {
    if (twin.pid <= 0 || twin.port == 0) std::abort();
    static_cast<void>(twin.label());
  }
  return 0;
}
