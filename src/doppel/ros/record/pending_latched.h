#pragma once
// The last messages of latched topics while nothing is written: a recording is paused, or a part of a bag
// begins later. They come first when it goes on, so that the robot is there.

#include <cstdint>
#include <map>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/record/bag_writer.h"

namespace doppel {

class DOPPEL_API PendingLatched {
 public:
  // Keeps the last `count` messages of the writer's topic, with 0 none.
  void keep(std::size_t topic, std::size_t count, std::uint32_t sequence, std::uint64_t publish_time,
            McapBytes data);
  // Writes them with this log time, and forgets them.
  void write(BagWriter& out, std::uint64_t log_time);

 private:
  struct Message {
    std::uint32_t sequence = 0;
    std::uint64_t publish_time = 0;
    std::vector<std::byte> data;
  };
  std::map<std::size_t, std::vector<Message>> topics_;
};

}  // namespace doppel
