#pragma once
// Several bags made of several others in one pass, as a file of `ros2 bag convert` describes them:
//
//   output_bags:
//   - uri: small
//     topics: [/joint_states, /tf]
//     compression_mode: file
//     compression_format: zstd

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/record/bag_writer.h"
#include "doppel/ros/record/topic_selection.h"

namespace doppel {

struct OutputBag {
  BagWriterOptions bag;
  TopicSelection topics;
  std::uint64_t start = 0, end = UINT64_MAX;     // log times in ns; the end is included
  std::map<std::string, SourceLocation> places;  // of the topics, by their names
  SourceLocation where;
};

// All keys of rosbag2's StorageOptions and RecordOptions are known; those that would change something which
// doppel does not do are notes. Without a compression there is none, and without a selection of topics the
// output is refused, which rosbag2 writes empty. Throws InputError with all errors of the file:
// "bag_outputs.syntax", "bag_outputs.unreadable", "bag_outputs.unknown_key", "bag_outputs.invalid".
[[nodiscard]] DOPPEL_API std::vector<OutputBag> read_output_bags(const std::filesystem::path& file,
                                                                 Diagnostics& notes);

// Throws InputError with all reasons why nothing would be written: a topic that no input has, an output
// without a topic, a folder that exists already.
DOPPEL_API void check_output_bags(const std::vector<BagReader>& inputs,
                                  const std::vector<OutputBag>& outputs);

struct WrittenBag {
  std::filesystem::path folder;
  std::uint64_t messages = 0, size = 0;  // bytes
};

// The messages of all inputs by their log times; of each file of a bag that was set back in time, as they
// follow one another. An output that begins later has the latched messages before it. `progress`: called with
// the completed fraction, 0..1; false ends it. All outputs are complete, or none is left: empty for work that
// was ended. Throws what the reader and the writer throw.
[[nodiscard]] DOPPEL_API std::vector<WrittenBag> convert_bags(
    std::vector<BagReader>& inputs, const std::vector<OutputBag>& outputs,
    const std::function<bool(double)>& progress = {});

}  // namespace doppel
