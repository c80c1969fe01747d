#pragma once
// What every client has heard and nobody has taken yet, and the part of Client that follows from it.

#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "doppel/client/client.h"
#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API ReceiveBuffer {
  std::map<std::string, Client::Topic> topics;
  std::map<std::string, Client::Service> services;
  std::deque<Client::Received> inbox;
  std::map<std::uint32_t, Client::Answer> answers;
  std::uint32_t calls = 0;  // the last one's number

  // Whether the answer has come; then it is taken.
  bool take(std::uint32_t call, Client::Answer& answer);
};

class DOPPEL_API BufferedClient : public Client {
 public:
  [[nodiscard]] const std::map<std::string, Topic>& topics() const final { return buffer().topics; }
  [[nodiscard]] const std::map<std::string, Service>& services() const final { return buffer().services; }
  bool next(Received& message, std::chrono::steady_clock::time_point until) final;
  bool take_answer(std::uint32_t call, Answer& answer) final { return buffer().take(call, answer); }

 private:
  [[nodiscard]] virtual ReceiveBuffer& buffer() const = 0;  // of the connection, which outlives every call
};

}  // namespace doppel
