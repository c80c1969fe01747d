// Fuzz target: a stream of Dynamixel frames. A frame that is found is one that this program would have sent.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "doppel/devices/frames/dynamixel_frame.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  doppel::DynamixelReader reader;
  const std::span<const std::uint8_t> all(data, size);
  for (std::size_t pushed = 0; pushed < size;) {
    pushed += reader.push(all.subspan(pushed, std::min<std::size_t>(size - pushed, 61)));
    while (const auto frame = reader.next()) {
      for (std::size_t servo = 0; reader.fast_part(servo, 10); ++servo) {
      }
      const bool fast = frame->id == doppel::kDynamixelBroadcast &&
                        frame->instruction == static_cast<std::uint8_t>(doppel::DynamixelInstruction::status);
      doppel::FrameBytes again;
      if (fast) {
        doppel::add_fast_answer(frame->parameters, again);
      } else {
        doppel::add_dynamixel_frame(*frame, again);
      }
      const auto bytes = again.bytes();
      if (std::search(all.begin(), all.end(), bytes.begin(), bytes.end()) == all.end()) std::abort();
    }
  }
  return 0;
}
