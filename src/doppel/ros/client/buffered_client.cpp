#include "doppel/ros/client/buffered_client.h"

#include <fmt/format.h>

#include <utility>

namespace doppel {

void ReceiveBuffer::keep(Client::Received message) {
  if (inbox.size() >= kMaxUnread) {
    ++lost;
  } else {
    inbox.push_back(std::move(message));
  }
}

bool ReceiveBuffer::take(std::uint32_t call, Client::Answer& answer) {
  auto found = answers.extract(call);
  if (!found) return false;
  answer = std::move(found.mapped());
  return true;
}

bool BufferedClient::next(Received& message, std::chrono::steady_clock::time_point until) {
  std::deque<Received>& inbox = buffer().inbox;
  if (!wait_until([&inbox] { return !inbox.empty(); }, until)) return false;
  if (const std::uint64_t lost = std::exchange(buffer().lost, 0); lost > 0)
    warn(fmt::format("lost messages: {}, because {} earlier ones were waiting to be read", lost,
                     inbox.size()));
  message = std::move(inbox.front());
  inbox.pop_front();
  return true;
}

}  // namespace doppel
