#include "doppel/core/arena.h"

namespace doppel {

void* Arena::allocate_anew(std::size_t bytes, std::size_t alignment) {
  const std::size_t needed = bytes + alignment;
  // A large piece gets a block of its own, so that the rest of the present one is not lost.
  const bool own = needed > next_ / 4 && end_ - at_ > static_cast<std::ptrdiff_t>(needed / 4);
  const std::size_t size = own ? needed : std::max(needed, next_);
  std::byte* const block = blocks_.emplace_back(new std::byte[size]).get();
  const std::size_t padding = (alignment - reinterpret_cast<std::size_t>(block) % alignment) % alignment;
  std::byte* const out = block + padding;
  if (own) return out;
  next_ = std::min(2 * next_, kLargest);
  at_ = out + bytes;
  end_ = block + size;
  return out;
}

}  // namespace doppel
