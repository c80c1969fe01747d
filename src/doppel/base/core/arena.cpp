#include "doppel/base/core/arena.h"

namespace doppel {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t kMaxSpare = 0;  // so that the sanitizer detects uses after free
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
constexpr std::size_t kMaxSpare = 0;
#else
constexpr std::size_t kMaxSpare = 32;
#endif
#else
constexpr std::size_t kMaxSpare = 32;
#endif

thread_local bool thread_ends = false;
struct Spare {
  ~Spare() { thread_ends = true; }
  std::vector<std::unique_ptr<std::byte[]>> blocks;
};
thread_local Spare spare;

}  // namespace

void* Arena::allocate_slow(std::size_t bytes, std::size_t alignment) {
  const std::size_t needed = bytes + alignment;
  const auto fit = [&](std::byte* block) {
    return block + (alignment - reinterpret_cast<std::size_t>(block) % alignment) % alignment;
  };
  // A large piece gets a separate block, so that the rest of the present one is not lost.
  if (needed > kBlock / 4) return fit(odd_.emplace_back(new std::byte[needed]).get());
  std::byte* block = nullptr;
  if (blocks_.empty() && odd_.empty() && needed <= kFirst) {
    block = odd_.emplace_back(new std::byte[kFirst]).get();
    end_ = block + kFirst;
  } else {
    if (!thread_ends && !spare.blocks.empty()) {
      blocks_.push_back(std::move(spare.blocks.back()));
      spare.blocks.pop_back();
    } else {
      blocks_.emplace_back(new std::byte[kBlock]);
    }
    block = blocks_.back().get();
    end_ = block + kBlock;
  }
  std::byte* const out = fit(block);
  at_ = out + bytes;
  return out;
}

void Arena::release() noexcept {
  for (Block& block : blocks_) {
    if (thread_ends || spare.blocks.size() >= kMaxSpare) break;
    try {
      spare.blocks.push_back(std::move(block));
    } catch (const std::bad_alloc&) {
      break;
    }
  }
  blocks_.clear();
  odd_.clear();
  at_ = end_ = nullptr;
}

}  // namespace doppel
