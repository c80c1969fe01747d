#include "doppel/devices/frames/frame_bytes.h"

#include <fmt/format.h>

#include <stdexcept>

namespace doppel {

void refuse_frame_size(std::string_view part, std::size_t size, std::size_t limit) {
  throw std::length_error(
      fmt::format("{} would be {} bytes long, and at most {} are possible", part, size, limit));
}

}  // namespace doppel
