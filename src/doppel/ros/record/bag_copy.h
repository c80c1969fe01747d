#pragma once
// Messages of a bag in another one.

#include <cstdint>
#include <functional>

#include "doppel/export.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/record/bag_writer.h"

namespace doppel {

// Copies messages with log times in [start, end) of the selected topics. The latest messages of the latched
// publishers before them come first, as many as BagReader::latched(), so that what was sent long before is
// there. `progress`: called with the completed fraction, 0..1; false ends it. False: it was ended. Throws
// what the reader and the writer throw.
DOPPEL_API bool copy_from(BagReader& bag, std::uint64_t start, std::uint64_t end,
                          const TopicSelection& topics, BagWriter& copy,
                          const std::function<bool(double)>& progress = {});

// Attachments, and metadata but rosbag2's own.
DOPPEL_API void copy_parts(BagReader& bag, BagWriter& copy);

[[nodiscard]] DOPPEL_API RecordedTopic recorded_topic(const BagReader& bag, std::size_t topic);

}  // namespace doppel
