// Fuzz target: a stream of servo lines. A line that is found is one that this program would have sent; its
// reply is read.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "doppel/devices/frames/servo_line.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  doppel::ServoLineReader reader;
  const std::span<const std::uint8_t> all(data, size);
  for (std::size_t pushed = 0; pushed < size;) {
    pushed += reader.push(all.subspan(pushed, std::min<std::size_t>(size - pushed, 61)));
    while (const auto body = reader.next()) {
      doppel::FrameBytes again;
      doppel::add_servo_line(*body, again);
      const auto bytes = again.bytes().first(again.size() - 1);  // the end may be "\r\n"
      if (std::search(all.begin(), all.end(), bytes.begin(), bytes.end()) == all.end()) std::abort();
      if (doppel::parse_servo_reply(*body).valueless_by_exception()) std::abort();
    }
  }
  // Bodies are also read without their check, which random bytes seldom have.
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (doppel::parse_servo_reply(text).valueless_by_exception()) std::abort();
  return 0;
}
