// doppel bag convert, cut, reindex: other bags of the messages of bags.

#include "doppel/ros/record/bag_copy.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "app/description_target.h"
#include "app/number_checks.h"
#include "app/output.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/interruptible_work.h"
#include "doppel/base/core/output_file.h"
#include "doppel/ros/record/bag_outputs.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxSeconds = 1e9;

struct CopyOptions {
  std::vector<std::string> bags;
  TopicSelection topics;
  BagOutput output;
  std::optional<double> start, end;  // s since the start of the bag
};

std::uint64_t nanoseconds(double seconds) {
  return static_cast<std::uint64_t>(std::max(0.0, seconds) * 1e9 + 0.5);
}

// False: interrupted.
bool copy_bag(const std::string& name, const CopyOptions& options, BagWriter& out) {
  BagReader bag(name);
  const std::uint64_t zero = bag.contents().start;
  const std::uint64_t start = options.start ? zero + nanoseconds(*options.start) : 0;
  const std::uint64_t end = options.end ? zero + nanoseconds(*options.end) : UINT64_MAX;
  check_selection(bag, options.topics);
  if (end <= start) {
    throw InputError("cli.use", make_location(name),
                     fmt::format("--end {:g} is not behind --start {:g}", options.end.value_or(0),
                                 options.start.value_or(0)),
                     "give both in seconds since the start of the recording");
  }
  if (start > bag.contents().end) {
    throw InputError(
        "cli.use", make_location(name),
        fmt::format("--start {:g} is behind the end of the recording, which has {:.3f} s",
                    options.start.value_or(0), static_cast<double>(bag.contents().end - zero) * 1e-9));
  }
  copy_parts(bag, out);
  const InterruptibleWork work("of the messages");
  return copy_from(bag, start, end, options.topics, out,
                   [&work](double done) { return work.progress(done); });
}

int run_copy(CopyOptions& options) {
  options.topics.check();
  BagWriter out(writer_options(options.output));
  try {
    for (const std::string& bag : options.bags) {
      if (copy_bag(bag, options, out)) continue;
      out.discard();
      return interrupted_without_output();
    }
    out.close();
  } catch (...) {
    out.discard();
    throw;
  }
  deliver(fmt::format("{}: {} messages, {}\n", out.folder().string(), out.metadata().messages,
                      size_text(out.size())));
  return 0;
}

// A file of rosbag2's output bags takes the place of a folder.
bool is_outputs_file(const std::string& output) {
  std::error_code none;
  const std::string ending = fs::path(output).extension().string();
  return fs::is_regular_file(output, none) ||
         ((ending == ".yaml" || ending == ".yml") && !fs::exists(output, none));
}

// ros2 bag convert names the storage behind a bag.
void take_storages(std::vector<std::string>& bags) {
  std::erase_if(bags, [&bags](const std::string& word) {
    std::error_code none;
    if (&word == bags.data() || (word != "mcap" && word != "sqlite3") || fs::exists(word, none)) return false;
    if (word == "sqlite3") {
      throw InputError("cli.use", {}, "bags of the storage sqlite3 cannot be read",
                       "convert it by ros2 bag convert, with storage_id: mcap");
    }
    return true;
  });
}

// Options would contradict what the file says about each output.
void check_no_output_options(const CLI::App& verb) {
  for (const CLI::Option* const option : verb.get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() == 0 || name == "input" || name == "output" || name == "help") continue;
    throw InputError("cli.use", {}, fmt::format("--{} cannot be combined with a file of output bags", name),
                     "write it into the file, as a key of the output");
  }
}

int run_outputs(const std::vector<std::string>& bags, const std::string& file) {
  Diagnostics notes;
  const std::vector<OutputBag> outputs = read_output_bags(file, notes);
  std::vector<BagReader> inputs;
  for (const std::string& bag : bags) inputs.emplace_back(bag);
  check_output_bags(inputs, outputs);
  print_diagnostics(notes, true);
  const InterruptibleWork work("of the messages");
  const std::vector<WrittenBag> written =
      convert_bags(inputs, outputs, [&work](double done) { return work.progress(done); });
  if (written.empty()) return interrupted_without_output();
  std::string text;
  for (const WrittenBag& bag : written)
    text += fmt::format("{}: {} messages, {}\n", bag.folder.string(), bag.messages, size_text(bag.size));
  deliver(text);
  return 0;
}

int run_reindex(const std::string& folder, bool force) {
  const fs::path file = fs::path(folder) / kBagMetadataFile;
  if (!fs::is_directory(folder)) {
    throw InputError("bag.no_files", {}, fmt::format("'{}' is not a folder", folder),
                     "name the folder of a bag; doppel bag recover gives a single file its index");
  }
  if (fs::exists(file) && !force) {
    throw InputError("output.unwritable", make_location(file.string()), "the bag has its metadata already",
                     "--force writes them again");
  }
  // write_whole() replaces it; the reader goes by the files that are there.
  BagReader bag(folder);
  const BagContents& contents = bag.contents();
  BagMetadata metadata{contents.start, contents.end - contents.start, contents.messages, {}, {}, {}, "jazzy"};
  for (const BagTopic& topic : contents.topics)
    metadata.topics.push_back(
        {topic.name, topic.type, topic.encoding, topic.qos, topic.type_hash, topic.messages});
  for (const std::string& name : contents.files) {
    const BagReader one(name);
    const BagContents& in_file = one.contents();
    metadata.files.push_back(
        {fs::path(name).filename().string(), in_file.start, in_file.end - in_file.start, in_file.messages});
  }
  write_whole(file, bag_metadata_text(metadata));
  std::string text =
      fmt::format("{}: {} files, {} messages\n", file.string(), metadata.files.size(), metadata.messages);
  for (const std::string& note : contents.notes) text += "note: " + note + "\n";
  deliver(text);
  return 0;
}

}  // namespace

void add_bag_convert(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand(
      "convert", "Write a bag of other topics, compression or sizes of files, also of several bags");
  const auto options = std::make_shared<CopyOptions>();
  verb->add_option("-i,--input,BAG", options->bags, "An .mcap file, or a folder of them; repeatable")
      ->required();
  add_output_options(*verb, options->output, true);
  verb->get_option("--output")
      ->description(
          "The bag's folder, which is made; or a YAML file of ros2 bag convert with several outputs")
      ->type_name("FOLDER|FILE");
  add_topic_options(*verb, options->topics);
  verb->footer(
      "Messages of several bags follow one another, bag after bag; with a file of outputs they are in the "
      "order "
      "of their times.\nExamples:\n  doppel bag convert my_run -o small "
      "--topics /joint_states /tf /tf_static /robot_description\n  doppel bag convert -i my_run -o parts "
      "--max-bag-duration 60 --compression lz4\n  doppel bag convert -i first -i second -o outputs.yaml\n"
      "outputs.yaml:\n  output_bags:\n  - uri: arm\n    topics: [/joint_states, /robot_description]\n"
      "  - uri: all\n    all_topics: true\n    compression_format: zstd\n    max_bagfile_duration: 60");
  verb->callback([options, verb, &exit_code] {
    take_storages(options->bags);
    if (is_outputs_file(options->output.folder)) {
      check_no_output_options(*verb);
      exit_code = run_outputs(options->bags, options->output.folder);
      return;
    }
    options->topics.hidden = true;
    exit_code = run_copy(*options);
  });
}

void add_bag_cut(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand("cut", "Write a bag of a part of another one's time");
  const auto options = std::make_shared<CopyOptions>();
  verb->add_option("BAG", options->bags, "An .mcap file, or a folder of them")->required()->expected(1);
  verb->add_option("--start", options->start, "Seconds since the start of the recording")
      ->check(CLI::Range(0.0, kMaxSeconds));
  verb->add_option("--end", options->end, "Seconds since the start of the recording")
      ->check(CLI::Range(0.0, kMaxSeconds));
  add_output_options(*verb, options->output, true);
  add_topic_options(*verb, options->topics);
  verb->footer(
      "The latest message of each latched topic before the start is kept, so that the robot is "
      "there.\nExamples:\n  "
      "doppel bag cut my_run -o fall --start 12.5 --end 20");
  verb->callback([options, &exit_code] {
    options->topics.hidden = true;
    exit_code = run_copy(*options);
  });
}

void add_bag_reindex(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand("reindex", "Write the metadata.yaml of a folder of .mcap files");
  const auto folder = std::make_shared<std::string>();
  const auto force = std::make_shared<bool>(false);
  verb->add_option("BAG", *folder, "The folder")->required();
  verb->add_flag("--force", *force, "Replace a metadata.yaml that is there");
  verb->footer(
      "The .mcap files are not changed; those that were not closed are read as a whole.\nExamples:\n  doppel "
      "bag "
      "reindex my_run");
  verb->callback([folder, force, &exit_code] { exit_code = run_reindex(*folder, *force); });
}

}  // namespace doppel::app
