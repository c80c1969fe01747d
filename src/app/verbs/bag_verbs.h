#pragma once
// The verbs of `doppel bag`, one file each, and what they share.

#include <cstdint>
#include <functional>
#include <string>

#include "doppel/base/mcap/mcap_writer.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/record/bag_writer.h"
#include "doppel/ros/record/topic_selection.h"

namespace CLI {
class App;
}

namespace doppel {
struct RosArguments;
}

namespace doppel::app {

void add_bag_record(CLI::App& bag, int& exit_code);
void add_bag_play(CLI::App& bag, const RosArguments& ros, int& exit_code);
void add_bag_convert(CLI::App& bag, int& exit_code);
void add_bag_cut(CLI::App& bag, int& exit_code);
void add_bag_reindex(CLI::App& bag, int& exit_code);
void add_bag_resimulate(CLI::App& bag, int& exit_code);

// -- options with the names of ros2 bag
// --topics, --regex, --exclude-topics, ...; of `record` also --all and its like.
void add_topic_options(CLI::App& verb, TopicSelection& topics);

struct BagOutput {
  std::string folder, compression = "zstd";
  std::uint64_t max_size = 0;  // bytes
  double max_time = 0;         // s
};
// --output, --compression, --max-bag-size, --max-bag-duration.
void add_output_options(CLI::App& verb, BagOutput& output, bool required);
[[nodiscard]] BagWriterOptions writer_options(const BagOutput& output);

// -- texts
[[nodiscard]] std::string size_text(std::uint64_t bytes);
// "12.5 s of the simulation", or a date.
[[nodiscard]] std::string bag_time_text(std::uint64_t time);

// Copies the messages that the reader gives next, their attachments, and metadata but rosbag2's own.
// `progress`: 0..1; false ends it. False: it was ended.
bool copy_messages(BagReader& source, BagWriter& copy, const std::function<bool(double)>& progress);
void copy_parts(BagReader& source, BagWriter& copy);
[[nodiscard]] RecordedTopic recorded_topic_of(const BagReader& bag, std::size_t topic);

}  // namespace doppel::app
