#pragma once
// Values by name, for many small tables that are searched often: the hash of a name is computed once and used
// for a whole chain of them.

#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

namespace doppel {

// Multiplies and folds eight bytes at a time.
inline std::uint32_t text_hash(std::string_view text) {
  constexpr std::uint64_t kFactor = 0x9E3779B97F4A7C15U;
  std::uint64_t out = text.size() * kFactor;
  const auto mix = [&out](std::uint64_t word) {
    out = (out ^ word) * kFactor;
    out ^= out >> 32;
  };
  const char* at = text.data();
  std::size_t left = text.size();
  for (; left >= 8; left -= 8, at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, at, 8);
    mix(word);
  }
  if (left >= 4) {
    std::uint32_t head = 0, tail = 0;
    std::memcpy(&head, at, 4);
    std::memcpy(&tail, at + left - 4, 4);
    mix(std::uint64_t{head} << 32 | tail);
  } else if (left > 0) {
    const auto byte = [at](std::size_t i) { return std::uint64_t{static_cast<unsigned char>(at[i])}; };
    mix(byte(0) << 16 | byte(left / 2) << 8 | byte(left - 1));
  }
  return static_cast<std::uint32_t>(out);
}

// The names are views of text that outlives the table. The result of find() is valid until an entry is added.
template <class T>
class TextTable {
 public:
  struct Entry {
    std::string_view name;
    std::uint32_t hash = 0;
    bool erased = false;
    T value;
  };

  [[nodiscard]] T* find(std::string_view name, std::uint32_t hash) {
    const std::size_t at = position(name, hash);
    return at < entries_.size() ? &entries_[at].value : nullptr;
  }
  [[nodiscard]] const T* find(std::string_view name, std::uint32_t hash) const {
    const std::size_t at = position(name, hash);
    return at < entries_.size() ? &entries_[at].value : nullptr;
  }
  [[nodiscard]] T* find(std::string_view name) {
    return entries_.empty() ? nullptr : find(name, text_hash(name));
  }
  [[nodiscard]] const T* find(std::string_view name) const {
    return entries_.empty() ? nullptr : find(name, text_hash(name));
  }
  // Replaces what was there.
  T& set(std::string_view name, T value) {
    const std::uint32_t hash = text_hash(name);
    if (T* const known = find(name, hash)) return *known = std::move(value);
    entries_.push_back({name, hash, false, std::move(value)});
    if (!index_.empty() && entries_.size() * 2 <= index_.size())
      place(entries_.size() - 1);
    else if (entries_.size() > kLinear)
      build();
    return entries_.back().value;
  }
  void erase(std::string_view name) {
    const std::size_t at = entries_.empty() ? 0 : position(name, text_hash(name));
    if (at >= entries_.size()) return;
    entries_[at].erased = true;
    entries_[at].value = T{};
  }
  // In order of their first setting; some may be erased.
  [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }

 private:
  static constexpr std::size_t kLinear = 12;

  [[nodiscard]] bool matches(const Entry& entry, std::string_view name, std::uint32_t hash) const {
    return entry.hash == hash && !entry.erased && entry.name == name;
  }
  [[nodiscard]] std::size_t position(std::string_view name, std::uint32_t hash) const {
    if (index_.empty()) {
      for (std::size_t i = 0; i < entries_.size(); ++i) {
        if (matches(entries_[i], name, hash)) return i;
      }
      return entries_.size();
    }
    const std::size_t mask = index_.size() - 1;
    for (std::size_t slot = hash & mask; index_[slot] != 0; slot = (slot + 1) & mask) {
      if (matches(entries_[index_[slot] - 1], name, hash)) return index_[slot] - 1;
    }
    return entries_.size();
  }
  void place(std::size_t which) {
    const std::size_t mask = index_.size() - 1;
    std::size_t slot = entries_[which].hash & mask;
    while (index_[slot] != 0) slot = (slot + 1) & mask;
    index_[slot] = static_cast<std::uint32_t>(which + 1);
  }
  void build() {
    std::size_t size = 64;
    while (size < 4 * entries_.size()) size *= 2;
    index_.assign(size, 0);
    for (std::size_t i = 0; i < entries_.size(); ++i) place(i);
  }

  std::vector<Entry> entries_;
  std::vector<std::uint32_t> index_;  // of entries by hash, from 1; empty while a search is as quick
};

}  // namespace doppel
