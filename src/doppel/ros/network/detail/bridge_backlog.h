#pragma once
// Private to the bridge: the tasks passed to the loop that have not run yet. While the loop is blocked, by a
// debugger or a slow step, samples wait in DDS histories, which drop the oldest ones.

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>

namespace doppel::ros2 {

class Backlog {
  struct Counts {
    std::atomic<std::size_t> messages{0}, bytes{0};
  };

 public:
  static constexpr std::size_t kMaxMessages = 2048;
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;

  // Passed with a task; what was added to it counts until end(), because finished tasks are not destroyed at
  // once. Any thread, one at a time.
  class Share {
   public:
    explicit Share(std::shared_ptr<Counts> counts) : counts_(std::move(counts)) {}
    ~Share() { end(); }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;
    void add(std::size_t bytes) {
      ++messages_;
      bytes_ += bytes;
      counts_->messages.fetch_add(1, std::memory_order_relaxed);
      counts_->bytes.fetch_add(bytes, std::memory_order_relaxed);
    }
    void end() {
      counts_->messages.fetch_sub(std::exchange(messages_, 0), std::memory_order_relaxed);
      counts_->bytes.fetch_sub(std::exchange(bytes_, 0), std::memory_order_relaxed);
    }

   private:
    std::shared_ptr<Counts> counts_;
    std::size_t messages_ = 0, bytes_ = 0;
  };

  [[nodiscard]] std::shared_ptr<Share> share() const { return std::make_shared<Share>(counts_); }
  [[nodiscard]] std::shared_ptr<Share> share(std::size_t bytes) const {
    auto made = share();
    made->add(bytes);
    return made;
  }
  // The last message may exceed the limit in bytes, so that one that is larger than the limit
  // is also delivered.
  [[nodiscard]] bool is_full() const {
    return counts_->messages.load(std::memory_order_relaxed) >= kMaxMessages ||
           counts_->bytes.load(std::memory_order_relaxed) >= kMaxBytes;
  }

 private:
  std::shared_ptr<Counts> counts_ = std::make_shared<Counts>();
};

}  // namespace doppel::ros2
