#include "doppel/ros/record/pending_latched.h"

#include <algorithm>

namespace doppel {

void PendingLatched::keep(std::size_t topic, std::size_t count, std::uint32_t sequence,
                          std::uint64_t publish_time, McapBytes data) {
  if (count == 0) return;
  std::vector<Message>& messages = topics_[topic];
  std::erase_if(messages, [&](const Message& other) { return std::ranges::equal(other.data, data); });
  if (messages.size() >= count) messages.erase(messages.begin());
  messages.push_back({sequence, publish_time, {data.begin(), data.end()}});
}

void PendingLatched::write(BagWriter& out, std::uint64_t log_time) {
  for (const auto& [topic, messages] : topics_) {
    for (const Message& message : messages)
      out.write(topic, message.sequence, log_time, message.publish_time, message.data);
  }
  topics_.clear();
}

}  // namespace doppel
