#include "doppel/ros2/late/fast_log.h"

#include <fastdds/dds/log/Log.hpp>
#include <mutex>

namespace doppel::ros2::fast {
namespace {

using eprosima::fastdds::dds::Log;

struct Kept {
  std::mutex mutex;
  Complaints complaints;
};

// Never destroyed: Fast DDS' log thread may outlive whatever main() has.
Kept& kept() {
  static Kept& instance = *new Kept;
  return instance;
}

class Consumer : public eprosima::fastdds::dds::LogConsumer {
 public:
  void Consume(const Log::Entry& entry) override { complain(entry.message); }
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

void complain(const std::string& text) {
  const std::lock_guard lock(kept().mutex);
  ++kept().complaints.count;
  kept().complaints.latest = text;
}

Complaints complaints() {
  const std::lock_guard lock(kept().mutex);
  return kept().complaints;
}

}  // namespace doppel::ros2::fast
