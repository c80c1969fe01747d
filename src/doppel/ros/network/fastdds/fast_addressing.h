#pragma once
// Sends each reply only to its client. DDS sends a sample to all readers of its topic: each of forty clients
// of one service would receive the replies to all, in a history of ten.

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "doppel/ros/network/fastdds/fast_dds.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

using Places = std::vector<rtps::Locator_t>;

// The locators of the readers of replies. Any thread.
class ReaderPlaces {
 public:
  void put(const Gid& reader, Places places) {
    const std::lock_guard lock(mutex_);
    places_.insert_or_assign(reader, std::move(places));
  }
  void remove(const Gid& reader) {
    const std::lock_guard lock(mutex_);
    places_.erase(reader);
  }
  void remove_participant(const Gid& participant) {
    const std::lock_guard lock(mutex_);
    std::erase_if(places_, [&](const auto& entry) { return is_same_participant(entry.first, participant); });
  }
  // Empty: unknown.
  [[nodiscard]] Places of(const Gid& reader) const {
    const std::lock_guard lock(mutex_);
    const auto found = places_.find(reader);
    return found == places_.end() ? Places() : found->second;
  }

 private:
  mutable std::mutex mutex_;
  std::map<Gid, Places> places_;
};

// During its lifetime, samples of `writer` that this thread sends go to `places` only; all other readers
// receive a GAP. Without places they go to all. Retransmissions, on other threads, go to their requester.
class AddressingScope {
 public:
  AddressingScope(const Gid& writer, Places places) : places_(std::move(places)) {
    std::copy(writer.bytes.begin() + Gid::kPrefixSize, writer.bytes.end(), writer_.begin());
    if (!places_.empty()) present_ = this;
  }
  ~AddressingScope() { present_ = nullptr; }
  AddressingScope(const AddressingScope&) = delete;
  AddressingScope& operator=(const AddressingScope&) = delete;

  // Of this thread; null: samples go to all readers.
  static const AddressingScope* present() { return present_; }
  [[nodiscard]] const std::array<std::uint8_t, 4>& writer() const { return writer_; }
  [[nodiscard]] bool is_at(const Places::value_type& place) const {
    return std::find(places_.begin(), places_.end(), place) != places_.end();
  }

 private:
  static inline thread_local const AddressingScope* present_ = nullptr;
  std::array<std::uint8_t, 4> writer_{};  // its entity
  Places places_;
};

}  // namespace doppel::ros2::fast
