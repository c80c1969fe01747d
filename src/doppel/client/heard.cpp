#include "doppel/client/heard.h"

namespace doppel {

bool Heard::take(std::uint32_t call, Client::Answer& answer) {
  auto found = answers.extract(call);
  if (!found) return false;
  answer = std::move(found.mapped());
  return true;
}

bool HearingClient::next(Received& message, std::chrono::steady_clock::time_point until) {
  std::deque<Received>& inbox = heard().inbox;
  if (!wait_until([&inbox] { return !inbox.empty(); }, until)) return false;
  message = std::move(inbox.front());
  inbox.pop_front();
  return true;
}

}  // namespace doppel
