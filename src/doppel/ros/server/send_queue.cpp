#include "doppel/ros/server/send_queue.h"

namespace doppel {
namespace {

constexpr std::size_t kFrameOverhead = 128;  // so that a flood of empty frames is bounded, too

std::size_t cost(const OutgoingFrame& frame) {
  return frame.size() + kFrameOverhead;
}

}  // namespace

std::size_t SendQueue::push(OutgoingFrame frame) {
  const std::size_t size = cost(frame);
  if (frame.kind != OutgoingFrame::Kind::message) {
    // A file does not count as a response, so that the client's requests are read while it is sent.
    if (frame.kind == OutgoingFrame::Kind::asset) {
      ++assets_;
    } else {
      answer_bytes_ += size;
    }
    answers_.push_back({next_order_++, std::move(frame)});
    return 0;
  }
  std::size_t dropped = 0;
  while (!data_.empty() && data_bytes_ + size > data_limit_) {
    data_bytes_ -= cost(data_.front().frame);
    data_.pop_front();
    ++dropped;
  }
  data_bytes_ += size;
  data_.push_back({next_order_++, std::move(frame)});
  return dropped;
}

bool SendQueue::is_answer_next() const {
  return data_.empty() || (!answers_.empty() && answers_.front().order < data_.front().order);
}

const OutgoingFrame* SendQueue::front() const {
  if (empty()) return nullptr;
  return &(is_answer_next() ? answers_ : data_).front().frame;
}

std::optional<OutgoingFrame> SendQueue::pop() {
  if (empty()) return std::nullopt;
  const bool answer = is_answer_next();
  std::deque<Entry>& from = answer ? answers_ : data_;
  OutgoingFrame frame = std::move(from.front().frame);
  from.pop_front();
  if (frame.kind == OutgoingFrame::Kind::asset) {
    --assets_;
  } else {
    (answer ? answer_bytes_ : data_bytes_) -= cost(frame);
  }
  return frame;
}

void SendQueue::clear() {
  answers_.clear();
  data_.clear();
  answer_bytes_ = data_bytes_ = assets_ = 0;
}

}  // namespace doppel
