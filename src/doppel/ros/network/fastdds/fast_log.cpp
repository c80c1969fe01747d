#include "doppel/ros/network/fastdds/fast_log.h"

#include <fastdds/dds/log/Log.hpp>
#include <mutex>

namespace doppel::ros2::fast {
namespace {

using eprosima::fastdds::dds::Log;

struct KeptLog {
  std::mutex mutex;
  MiddlewareLog middleware_log;
};

// Never destroyed, because Fast DDS's log thread may outlive the objects of main().
KeptLog& kept_log() {
  static KeptLog& instance = *new KeptLog;
  return instance;
}

class Consumer : public eprosima::fastdds::dds::LogConsumer {
 public:
  void Consume(const Log::Entry& entry) override { log_message(entry.message); }
};

}  // namespace

void catch_log() {
  static const bool once = [] {
    Log::ClearConsumers();
    Log::SetVerbosity(Log::Error);
    Log::RegisterConsumer(std::make_unique<Consumer>());
    return true;
  }();
  static_cast<void>(once);
}

void log_message(const std::string& text) {
  const std::lock_guard lock(kept_log().mutex);
  ++kept_log().middleware_log.count;
  kept_log().middleware_log.latest = text;
}

MiddlewareLog middleware_log() {
  const std::lock_guard lock(kept_log().mutex);
  return kept_log().middleware_log;
}

}  // namespace doppel::ros2::fast
