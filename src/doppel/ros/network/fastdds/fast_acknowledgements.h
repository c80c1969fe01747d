#pragma once
// The matched readers that have not acknowledged any sample of a writer yet. Fast DDS reports a match when it
// has discovered the reader; the reader may discover the writer 70 ms later.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <utility>

#include "doppel/ros/network/detail/rtps_guard.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

// Any thread.
class Acknowledgements {
 public:
  explicit Acknowledgements(std::function<void()> on_activity) : on_activity_(std::move(on_activity)) {}

  void await(const Gid& writer, const Gid& reader) {
    const std::lock_guard lock(mutex_);
    awaited_.insert(key(writer, reader));
    is_idle_ = false;
  }
  void forget(const Gid& writer, const Gid& reader) {
    const std::lock_guard lock(mutex_);
    awaited_.erase(key(writer, reader));
    is_idle_ = awaited_.empty();
  }
  void forget(const Gid& writer) {
    const auto entity = key(writer, {}).first;
    const std::lock_guard lock(mutex_);
    std::erase_if(awaited_, [&entity](const Key& awaited) { return awaited.first == entity; });
    is_idle_ = awaited_.empty();
  }
  [[nodiscard]] bool is_awaited(const Gid& writer, const Gid& reader) const {
    const std::lock_guard lock(mutex_);
    return awaited_.contains(key(writer, reader));
  }

  void receive(const Acknowledgement& acknowledgement) {
    if (is_idle_) return;
    {
      const std::lock_guard lock(mutex_);
      if (awaited_.erase({acknowledgement.writer, Gid{acknowledgement.reader}}) == 0) return;
      is_idle_ = awaited_.empty();
    }
    on_activity_();
  }

 private:
  using Key = std::pair<std::array<std::uint8_t, 4>, Gid>;  // the writer's entity; the reader
  static Key key(const Gid& writer, const Gid& reader) {
    Key made{{}, reader};
    std::copy(writer.bytes.begin() + Gid::kPrefixSize, writer.bytes.end(), made.first.begin());
    return made;
  }

  const std::function<void()> on_activity_;
  mutable std::mutex mutex_;
  std::set<Key> awaited_;
  std::atomic<bool> is_idle_{true};
};

}  // namespace doppel::ros2::fast
