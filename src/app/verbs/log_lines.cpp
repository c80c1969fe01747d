#include "app/verbs/log_lines.h"

#include <algorithm>

#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
using RosoutLine = rcl_interfaces::msg::Log;

constexpr const char* kRosout = "/rosout";
constexpr auto kLineTimeout = std::chrono::milliseconds(1000);  // lines are published after the response
constexpr auto kQuietTime = std::chrono::milliseconds(150);  // without a further line: this was the last one

}  // namespace

LogLines::LogLines(Client& twin) : twin_(twin) {
  const auto topic = twin_.topics().find(kRosout);
  if (topic == twin_.topics().end() || topic->second.publishers.empty()) return;
  twin_.subscribe(kRosout);
  twin_.sync();
  subscribed_ = true;
}

LogLines::~LogLines() {
  if (!subscribed_) return;
  try {
    twin_.unsubscribe(kRosout);
  } catch (...) {
    subscribed_ = false;  // the connection has failed, and with it the subscription
  }
}

void LogLines::take(const Client::Received& message) {
  if (message.topic != kRosout) return;
  const RosoutLine line = decode<RosoutLine>(message.cdr);
  if (line.level >= RosoutLine::WARN) last_[line.name] = line.msg;
}

std::string LogLines::last_problem(const std::string& node) {
  if (!subscribed_) return "";
  const std::string logger = logger_name(node);
  const auto end = Clock::now() + kLineTimeout;
  auto until = end;
  Client::Received message;
  while (twin_.next(message, until)) {
    take(message);
    if (last_.contains(logger)) until = std::min(end, Clock::now() + kQuietTime);
  }
  const auto found = last_.find(logger);
  return found == last_.end() ? "" : found->second;
}

std::string LogLines::reason(const std::string& node) {
  const std::string line = last_problem(node);
  return line.empty() ? kReasonElsewhere : ": " + line;
}

}  // namespace doppel::app
