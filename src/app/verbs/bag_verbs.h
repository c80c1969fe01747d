#pragma once
// The verbs of `doppel bag`, one file each, and what they share.

#include <cstdint>
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
void add_bag_snapshot(CLI::App& bag, int& exit_code);
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

// Throws InputError: no topic of the bag is selected, with the names that are near to those that are given.
void check_selection(const BagReader& bag, const TopicSelection& topics);

// -- texts
[[nodiscard]] std::string size_text(std::uint64_t bytes);
// "12.5 s of the simulation", or a date.
[[nodiscard]] std::string bag_time_text(std::uint64_t time);

}  // namespace doppel::app
