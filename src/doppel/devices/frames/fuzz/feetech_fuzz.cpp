// Fuzz target: a stream of Feetech frames. A frame that is found is one that this program would have sent.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "doppel/devices/frames/feetech_frame.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  doppel::FeetechReader reader;
  const std::span<const std::uint8_t> all(data, size);
  for (std::size_t pushed = 0; pushed < size;) {
    pushed += reader.push(all.subspan(pushed, std::min<std::size_t>(size - pushed, 61)));
    while (const auto frame = reader.next()) {
      doppel::FrameBytes again;
      doppel::add_feetech_frame(*frame, again);
      const auto bytes = again.bytes();
      if (std::search(all.begin(), all.end(), bytes.begin(), bytes.end()) == all.end()) std::abort();
    }
  }
  return 0;
}
