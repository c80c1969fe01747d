#include "doppel/ros/client/buffered_client.h"

namespace doppel {

bool ReceiveBuffer::take(std::uint32_t call, Client::Answer& answer) {
  auto found = answers.extract(call);
  if (!found) return false;
  answer = std::move(found.mapped());
  return true;
}

bool BufferedClient::next(Received& message, std::chrono::steady_clock::time_point until) {
  std::deque<Received>& inbox = buffer().inbox;
  if (!wait_until([&inbox] { return !inbox.empty(); }, until)) return false;
  message = std::move(inbox.front());
  inbox.pop_front();
  return true;
}

}  // namespace doppel
