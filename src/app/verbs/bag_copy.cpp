// doppel bag convert, cut, reindex: other bags of the messages of bags.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "app/number_checks.h"
#include "app/output.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/interruptible_work.h"
#include "doppel/base/core/output_file.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct CopyOptions {
  std::vector<std::string> bags;
  TopicSelection topics;
  BagOutput output;
  std::optional<double> start, end;  // s since the start of the bag
};

std::uint64_t nanoseconds(double seconds) {
  return static_cast<std::uint64_t>(std::max(0.0, seconds) * 1e9 + 0.5);
}

// The latest message of each latched topic before `start`, so that what was sent long before is there.
void copy_latched(BagReader& bag, std::uint64_t start, const TopicSelection& topics, BagWriter& out) {
  std::map<std::size_t, std::vector<std::byte>> latest;
  bag.seek(0, start, topics);
  while (const auto message = bag.next()) {
    if (bag.is_latched(message->topic)) latest[message->topic] = {message->data.begin(), message->data.end()};
  }
  for (const auto& [topic, data] : latest)
    out.write(out.add_topic(recorded_topic_of(bag, topic)), 0, start, start, data);
}

// False: interrupted.
bool copy_bag(const std::string& name, const CopyOptions& options, BagWriter& out) {
  BagReader bag(name);
  const std::uint64_t zero = bag.contents().start;
  const std::uint64_t start = options.start ? zero + nanoseconds(*options.start) : 0;
  const std::uint64_t end = options.end ? zero + nanoseconds(*options.end) : UINT64_MAX;
  if (start > bag.contents().end || end <= start) {
    throw InputError(
        "cli.use", make_location(name),
        fmt::format("nothing lies between {} s and {} s of a recording of {:.3f} s",
                    options.start.value_or(0), options.end ? std::to_string(*options.end) : "its end",
                    static_cast<double>(bag.contents().end - zero) * 1e-9),
        "give --start and --end in seconds since the start of the recording");
  }
  copy_parts(bag, out);
  if (start > 0) copy_latched(bag, start, options.topics, out);
  bag.seek(start, end, options.topics);
  const InterruptibleWork work("of the messages");
  return copy_messages(bag, out, [&work](double done) { return work.progress(done); });
}

int run_copy(CopyOptions& options) {
  options.topics.check();
  BagWriter out(writer_options(options.output));
  try {
    for (const std::string& bag : options.bags) {
      if (copy_bag(bag, options, out)) continue;
      out.close();
      fs::remove_all(out.folder());
      return interrupted_without_output();
    }
    out.close();
  } catch (...) {
    std::error_code none;
    fs::remove_all(out.folder(), none);
    throw;
  }
  deliver(fmt::format("{}: {} messages, {}\n", out.folder().string(), out.metadata().messages,
                      size_text(out.size())));
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
  if (force) fs::remove(file);
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

RecordedTopic recorded_topic_of(const BagReader& bag, std::size_t topic) {
  const BagTopic& about = bag.contents().topics[topic];
  return {about.name,      about.type, about.encoding,       about.schema, about.schema_encoding,
          about.type_hash, about.qos,  bag.is_latched(topic)};
}

bool copy_messages(BagReader& source, BagWriter& copy, const std::function<bool(double)>& progress) {
  constexpr std::uint64_t kLook = 4096;  // messages between two reports of progress
  std::map<std::size_t, std::size_t> topics;
  std::uint64_t count = 0;
  while (const auto message = source.next()) {
    const auto found = topics.find(message->topic);
    const std::size_t topic = found != topics.end()
                                  ? found->second
                                  : topics[message->topic] =
                                        copy.add_topic(recorded_topic_of(source, message->topic));
    copy.write(topic, message->sequence, message->log_time, message->publish_time, message->data);
    if (++count % kLook == 0 &&
        !progress(static_cast<double>(count) / static_cast<double>(source.contents().messages)))
      return false;
  }
  return true;
}

void copy_parts(BagReader& source, BagWriter& copy) {
  for (const BagPart& part : source.contents().attachments)
    copy.attach({part.part.name, "application/octet-stream", source.attachment(part)},
                source.contents().start);
  for (const BagPart& part : source.contents().metadata) {
    if (part.part.name != "rosbag2") copy.add_metadata(part.part.name, source.metadata(part));
  }
}

void add_bag_convert(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand(
      "convert", "Write a bag of other topics, compression or sizes of files, also of several bags");
  const auto options = std::make_shared<CopyOptions>();
  verb->add_option("-i,--input,BAG", options->bags, "An .mcap file, or a folder of them; repeatable")
      ->required();
  add_output_options(*verb, options->output, true);
  add_topic_options(*verb, options->topics);
  verb->footer(
      "Messages of several bags follow one another, bag after bag.\nExamples:\n  doppel bag convert my_run "
      "-o small "
      "--topics /joint_states /tf /tf_static /robot_description\n  doppel bag convert -i my_run -o parts "
      "--max-bag-duration 60 --compression lz4");
  verb->callback([options, &exit_code] {
    options->topics.hidden = true;
    exit_code = run_copy(*options);
  });
}

void add_bag_cut(CLI::App& bag, int& exit_code) {
  CLI::App* verb = bag.add_subcommand("cut", "Write a bag of a part of another one's time");
  const auto options = std::make_shared<CopyOptions>();
  verb->add_option("BAG", options->bags, "An .mcap file, or a folder of them")->required()->expected(1);
  verb->add_option("--start", options->start, "Seconds since the start of the recording");
  verb->add_option("--end", options->end, "Seconds since the start of the recording");
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
