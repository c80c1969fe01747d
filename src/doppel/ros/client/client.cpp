#include "doppel/ros/client/client.h"

#include <fmt/format.h>

#include "doppel/base/core/near_names.h"

namespace doppel {
namespace {

using Clock = std::chrono::steady_clock;

template <class Entry>
const Entry& find(const std::map<std::string, Entry>& entries, const std::string& name, const char* what) {
  const auto found = entries.find(name);
  if (found != entries.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, entry] : entries) names.push_back(known);
  throw ClientError(fmt::format("there is no {} {}{}", what, name, names_near(name, names)));
}

}  // namespace

const Client::Topic& Client::find_topic(const std::string& name) const {
  return find(topics(), name, "topic");
}
const Client::Service& Client::find_service(const std::string& name) const {
  return find(services(), name, "service");
}

Client::Answer Client::call(const std::string& service, std::span<const std::byte> request,
                            std::chrono::milliseconds at_most) {
  const std::uint32_t call = begin_call(service, request);
  Answer answer;
  bool taken = false;
  const auto until = Clock::now() + (at_most.count() < 0 ? std::chrono::hours(24 * 365) : at_most);
  if (!wait_until([&] { return taken = taken || take_answer(call, answer); }, until)) {
    throw ClientError(fmt::format("service {} did not answer within {} s", service,
                                  static_cast<double>(at_most.count()) / 1e3));
  }
  return answer;
}

}  // namespace doppel
