#pragma once
// The queue of one client: responses and files, which are never dropped, and messages, of which the oldest
// are dropped when there are too many. First in, first out.

#include <cstdint>
#include <deque>
#include <optional>

#include "doppel/export.h"
#include "doppel/ros/server/hub.h"

namespace doppel {

class DOPPEL_API SendQueue {
 public:
  explicit SendQueue(std::size_t data_limit) : data_limit_(data_limit) {}

  // Returns the number of dropped messages. A single message above the limit is still sent if no
  // other message waits.
  std::size_t push(OutgoingFrame frame);
  std::optional<OutgoingFrame> pop();
  // The frame that pop() would return; nullptr: none.
  [[nodiscard]] const OutgoingFrame* front() const;
  void clear();

  [[nodiscard]] bool has_answers() const { return !answers_.empty(); }
  [[nodiscard]] bool empty() const { return answers_.empty() && data_.empty(); }
  [[nodiscard]] std::size_t answer_bytes() const { return answer_bytes_; }
  [[nodiscard]] std::size_t assets() const { return assets_; }
  [[nodiscard]] std::size_t data_bytes() const { return data_bytes_; }

 private:
  struct Entry {
    std::uint64_t order = 0;
    OutgoingFrame frame;
  };
  [[nodiscard]] bool is_answer_next() const;

  std::size_t data_limit_;
  std::uint64_t next_order_ = 0;
  std::deque<Entry> answers_, data_;
  std::size_t answer_bytes_ = 0, data_bytes_ = 0, assets_ = 0;
};

}  // namespace doppel
