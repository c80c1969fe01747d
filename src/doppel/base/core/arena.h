#pragma once
// Memory for trees that are built piece by piece and freed at once: an allocation moves a pointer, nothing is
// freed before the arena, and no destructor runs. For one thread. Allocations throw std::bad_alloc.

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API Arena {
 public:
  Arena() = default;
  ~Arena() { release(); }
  Arena(Arena&& other) noexcept { take(other); }
  Arena& operator=(Arena&& other) noexcept {
    if (this != &other) {
      release();
      take(other);
    }
    return *this;
  }

  [[nodiscard]] void* allocate(std::size_t bytes, std::size_t alignment = alignof(std::max_align_t)) {
    const std::size_t padding = (alignment - reinterpret_cast<std::size_t>(at_) % alignment) % alignment;
    if (padding + bytes > static_cast<std::size_t>(end_ - at_)) return allocate_slow(bytes, alignment);
    std::byte* const out = at_ + padding;
    at_ = out + bytes;
    return out;
  }
  template <class T, class... Arguments>
  [[nodiscard]] T* make(Arguments&&... arguments) {
    static_assert(std::is_trivially_destructible_v<T>);
    return new (allocate(sizeof(T), alignof(T))) T{std::forward<Arguments>(arguments)...};
  }
  // Value-initialised.
  template <class T>
  [[nodiscard]] std::span<T> array(std::size_t size) {
    static_assert(std::is_trivially_destructible_v<T>);
    if (size == 0) return {};
    T* const first = static_cast<T*>(allocate(size * sizeof(T), alignof(T)));
    std::uninitialized_value_construct_n(first, size);
    return {first, size};
  }
  template <class T>
  [[nodiscard]] std::span<T> copy(std::span<const T> from) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (from.empty()) return {};
    T* const first = static_cast<T*>(allocate(from.size_bytes(), alignof(T)));
    std::uninitialized_copy(from.begin(), from.end(), first);
    return {first, from.size()};
  }
  [[nodiscard]] std::string_view copy(std::string_view text) {
    if (text.empty()) return {};
    auto* const out = static_cast<char*>(allocate(text.size(), 1));
    std::memcpy(out, text.data(), text.size());
    return {out, text.size()};
  }

 private:
  using Block = std::unique_ptr<std::byte[]>;
  static constexpr std::size_t kFirst = std::size_t{8} << 10, kBlock = std::size_t{64} << 10;

  void* allocate_slow(std::size_t bytes, std::size_t alignment);
  void release() noexcept;
  void take(Arena& other) noexcept {
    blocks_ = std::exchange(other.blocks_, {});
    odd_ = std::exchange(other.odd_, {});
    at_ = std::exchange(other.at_, nullptr);
    end_ = std::exchange(other.end_, nullptr);
  }

  std::vector<Block> blocks_;  // of kBlock bytes
  std::vector<Block> odd_;     // the first one, and those of large pieces
  std::byte *at_ = nullptr, *end_ = nullptr;
};

}  // namespace doppel
