#pragma once
// The receive buffer of a client, and the part of Client that only needs this buffer.

#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/client/client.h"

namespace doppel {

struct DOPPEL_API ReceiveBuffer {
  static constexpr std::size_t kMaxUnread = 100'000;  // messages

  std::map<std::string, Client::Topic> topics;
  std::map<std::string, Client::Service> services;
  std::deque<Client::Received> inbox;
  std::uint64_t lost = 0;  // messages that have come while so many waited, and that were not reported yet
  std::map<std::uint32_t, Client::Answer> answers;
  std::uint32_t calls = 0;  // number of the last call

  // For next(). Such messages wait while the program waits for something else, such as an answer.
  void keep(Client::Received message);
  // True: the response has arrived, and is moved to `answer`.
  bool take(std::uint32_t call, Client::Answer& answer);
};

class DOPPEL_API BufferedClient : public Client {
 public:
  [[nodiscard]] const std::map<std::string, Topic>& topics() const final { return buffer().topics; }
  [[nodiscard]] const std::map<std::string, Service>& services() const final { return buffer().services; }
  bool next(Received& message, std::chrono::steady_clock::time_point until) final;
  bool take_answer(std::uint32_t call, Answer& answer) final { return buffer().take(call, answer); }

 private:
  [[nodiscard]] virtual ReceiveBuffer& buffer() const = 0;  // of the connection
  virtual void warn(const std::string& text) const = 0;
};

}  // namespace doppel
