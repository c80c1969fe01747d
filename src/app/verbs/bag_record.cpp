// doppel bag record: the topics of a running twin, or of a ROS 2 graph, as a bag.

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>

#include "app/number_checks.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/client_recorder.h"
#include "app/verbs/foreign_options.h"
#include "app/verbs/raw_terminal.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/network/bridge.h"
#include "doppel/ros/record/recorder_services.h"

namespace doppel::app {
namespace {

struct RecordOptions {
  TopicSelection topics;
  BagOutput output;
  ClientRecorderOptions recorder;
  std::string storage, preset, compression_mode, format, node = "rosbag2_recorder";
  std::vector<std::string> custom;  // key=value
  std::size_t cache = std::size_t{100} << 20;
  bool no_discovery = false, no_keys = false, no_ros = false;
};

// Services publish their calls only where that is switched on; a twin of doppel has a parameter for it.
void publish_service_calls(Client& client, const TopicSelection& topics) {
  const bool is_asked =
      topics.all_services || topics.all_actions || !topics.services.empty() || !topics.actions.empty();
  if (!is_asked) return;
  const std::vector<std::string> nodes = client.nodes();
  if (std::ranges::find(nodes, "/gazebo") == nodes.end()) return;
  if (client.set_parameter("/gazebo", "service_introspection", std::string("contents")))
    print_note("note: /gazebo service_introspection is now 'contents', so that services publish their calls");
}

std::map<std::string, std::string> custom_data(const std::vector<std::string>& texts) {
  std::map<std::string, std::string> out;
  for (const std::string& text : texts) {
    const std::size_t split = text.find('=');
    if (split == std::string::npos || split == 0)
      throw_usage_error(fmt::format("--custom-data '{}' is not KEY=VALUE", text));
    out[text.substr(0, split)] = text.substr(split + 1);
  }
  return out;
}

ClientRecorderOptions recorder_options(const RecordOptions& options, bool is_remote) {
  ClientRecorderOptions out = options.recorder;
  out.topics = options.topics;
  out.bag = writer_options(options.output);
  if (out.bag.folder.empty()) out.bag.folder = dated_bag_folder(".").lexically_normal();
  out.bag.custom = custom_data(options.custom);
  if (options.compression_mode == "none" || options.preset == "fastwrite") out.bag.file.compression.clear();
  constexpr int kSmall = 19;  // the level of zstd_small
  if (options.preset == "zstd_small") out.bag.file.level = kSmall;
  out.discovers = !options.no_discovery;
  out.snapshot_bytes = options.cache;
  out.sim_time = out.sim_time && is_remote;  // a twin's times are simulated anyway
  return out;
}

// The services of rosbag2's recorder on the ROS 2 network, and the space key, while a recorder runs.
class RecorderControls {
 public:
  explicit RecorderControls(const RecordOptions& options) : options_(options) {
    if (!options.no_keys && isatty(STDIN_FILENO) != 0) terminal_.emplace(STDIN_FILENO);
  }

  void begin(ClientRecorder& recorder) {
    recorder_ = &recorder;
    const auto act = [&recorder](RecorderAction action, const std::function<void(bool)>& done) {
      recorder.act(action);
      done(true);
    };
    RecorderControl control{act, [&recorder] { return recorder.is_paused(); },
                            options_.recorder.snapshot_mode};
    services_.emplace(bus_, std::move(control), absolute(options_.node));
    if (options_.no_ros) return;
    Diagnostics diagnostics;
    log_.add_sink([](const LogLine& line) { print_note("note: " + line.text); });
    bridge_.emplace(bus_,
                    ros2::BridgeOptions{.network = ros2::from_environment(
                                            [](const char* name) { return std::getenv(name); }, diagnostics),
                                        .diagnostics_node = ""},
                    log_);
  }
  void look() {
    bus_.spin();
    if (!terminal_) return;
    while (const auto key = terminal_->next(std::chrono::steady_clock::now())) {
      if (*key == ' ') recorder_->act(RecorderAction::toggle_paused);
    }
  }

 private:
  const RecordOptions& options_;
  std::optional<RawTerminal> terminal_;
  ClientRecorder* recorder_ = nullptr;
  Log log_;
  Bus bus_{{.sim_time = false}};
  std::optional<RecorderServices> services_;
  std::optional<ros2::Bridge> bridge_;
};

// The reason of an early end; empty: it is the normal one.
std::string run_until_end(ClientRecorder& recorder) {
  try {
    recorder.run();
  } catch (const Interrupted&) {
    return "";
  } catch (const ClientError& error) {
    return error.what();
  }
  return "";
}

int report_bag(const BagWriter& writer, bool snapshot_mode) {
  const BagMetadata& recorded = writer.metadata();
  if (recorded.messages > 0) {
    print_line("{}: {} messages, {}\n", writer.folder().string(), recorded.messages,
               size_text(writer.size()));
    return 0;
  }
  std::filesystem::remove_all(writer.folder());
  print_note(snapshot_mode ? "no snapshot was taken, so that there is no bag"
                           : "no message came, so that there is no bag; doppel topic list has the topics");
  return 1;
}

int run_record(Shell& shell, const RecordOptions& options) {
  options.topics.check();
  ClientRecorderOptions chosen = recorder_options(options, shell.is_remote());
  if (const Status fine = check_node_name(options.node); !fine)
    throw_usage_error(fmt::format("--node-name '{}': {}", options.node, fine.why()));
  Shell::catch_interrupts();
  RecorderControls controls(options);
  chosen.look = [&controls] { controls.look(); };
  Client& client = shell.twin();
  publish_service_calls(client, options.topics);
  ClientRecorder recorder(client, chosen);
  controls.begin(recorder);
  print_note(fmt::format("recording to {}{}; Ctrl-C ends it", chosen.bag.folder.string(),
                         chosen.paused ? ", paused" : ""));
  const std::string failure = run_until_end(recorder);
  Shell::clear_interrupt();
  controls.look();  // the answer to stop
  recorder.close();
  if (isatty(STDERR_FILENO) != 0) print_note("");
  const int code = report_bag(recorder.writer(), chosen.snapshot_mode);
  if (failure.empty() || code != 0) return code;
  print_note("warning: the recording has ended early: " + failure);
  return 1;
}

int run_snapshot(Shell& shell, const NoOptions& /*options*/) {
  const auto answer = call<std_srvs::srv::Trigger>(shell.twin(), "/doppel/snapshot");
  if (!answer.success) throw ClientError(answer.message);
  print_line("{}\n", answer.message);
  return 0;
}

}  // namespace

void add_topic_options(CLI::App& verb, TopicSelection& topics) {
  verb.add_option("--topics", topics.topics, "These topics")->take_all();
  verb.add_option("-e,--regex", topics.regex, "Topics whose name matches a regular expression");
  verb.add_option("-x,--exclude-regex", topics.exclude_regex, "But not those that match this one");
  verb.add_option("--exclude-topics", topics.exclude_topics, "But not these topics")->take_all();
  verb.add_option("--topic-types", topics.types, "Topics of these types")->take_all();
  verb.add_option("--exclude-topic-types", topics.exclude_types, "But not topics of these types")->take_all();
  verb.add_option("--services", topics.services, "The calls of these services")->take_all();
  verb.add_option("--actions", topics.actions, "Goals, feedback and results of these actions")->take_all();
  verb.add_option("--exclude-services", topics.exclude_services, "But not the calls of these services")
      ->take_all();
  verb.add_option("--exclude-actions", topics.exclude_actions, "But not these actions")->take_all();
}

void check_selection(const BagReader& bag, const TopicSelection& topics) {
  std::vector<std::string> names;
  bool any = false;
  for (const BagTopic& topic : bag.contents().topics) {
    names.push_back(topic.name);
    any = any || topics.selects(topic.name, topic.type);
  }
  for (const std::string& name : topics.topics) {
    if (std::ranges::find(names, name) != names.end()) continue;
    throw InputError("cli.use", make_location(bag.contents().files.front()),
                     fmt::format("there is no topic {}{}", name, did_you_mean(name, names)),
                     "doppel bag info lists the topics");
  }
  if (!any && !names.empty()) {
    throw InputError("cli.use", make_location(bag.contents().files.front()),
                     "no topic of the recording is selected",
                     "doppel bag info lists the topics with their types");
  }
}

void add_output_options(CLI::App& verb, BagOutput& output, bool required) {
  CLI::Option* const folder =
      verb.add_option("-o,--output,--out", output.folder, "The bag's folder, which is made");
  folder->type_name("FOLDER");
  if (required) folder->required();
  verb.add_option("--compression,--compression-format", output.compression, "zstd, lz4, or none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}));
  verb.add_option("-b,--max-bag-size", output.max_size, "A new file after so many bytes (default: never)");
  verb.add_option("-d,--max-bag-duration", output.max_time,
                  "A new file after so many seconds (default: never)")
      ->check(positive_number());
}

BagWriterOptions writer_options(const BagOutput& output) {
  BagWriterOptions out;
  out.folder = output.folder;
  out.file.compression = output.compression == "none" ? "" : output.compression;
  out.max_file_size = output.max_size;
  out.max_file_time = from_seconds(output.max_time);
  out.distro = to_string(ros_distro());
  return out;
}

namespace {

void declare_topics(CLI::App& verb, RecordOptions& options) {
  verb.add_option("topic", options.topics.topics, "Topics (default: all)");
  verb.add_flag("-a,--all", options.topics.all, "All topics, services and actions");
  verb.add_flag("--all-topics", options.topics.all_topics, "All topics");
  verb.add_flag("--all-services", options.topics.all_services, "The calls of all services");
  verb.add_flag("--all-actions", options.topics.all_actions, "All actions");
  verb.add_flag("--include-hidden-topics", options.topics.hidden, "Hidden topics, too");
  add_topic_options(verb, options.topics);
  verb.add_flag("--include-unpublished-topics", options.recorder.include_unpublished,
                "Topics without a publisher, too");
  verb.add_flag("--ignore-leaf-topics", options.recorder.ignore_leaf, "Not topics without a subscriber");
  verb.add_flag("--no-discovery", options.no_discovery, "Only topics that are there at the beginning");
}

void declare_output(CLI::App& verb, RecordOptions& options) {
  add_output_options(verb, options.output, false);
  verb.add_option("-s,--storage", options.storage, "The storage of the bag: mcap")
      ->check(CLI::IsMember({"mcap"}));
  verb.add_option("--compression-mode", options.compression_mode,
                  "none; file and message are the same: chunks are compressed")
      ->check(CLI::IsMember({"none", "file", "message"}));
  verb.add_option("--storage-preset-profile", options.preset,
                  "none, fastwrite (not compressed), zstd_fast, or zstd_small")
      ->check(CLI::IsMember({"none", "fastwrite", "zstd_fast", "zstd_small"}));
  verb.add_option("--custom-data", options.custom, "KEY=VALUE for the custom data of metadata.yaml")
      ->take_all();
  verb.add_option("-f,--serialization-format", options.format, "The format of messages: cdr")
      ->check(CLI::IsMember({"cdr"}));
}

void declare_run(CLI::App& verb, RecordOptions& options) {
  verb.add_option("--duration", options.recorder.duration,
                  "Seconds after which it ends (default: until Ctrl-C)")
      ->check(positive_number());
  verb.add_flag("--start-paused", options.recorder.paused, "Begin paused; the space key goes on");
  verb.add_flag("--use-sim-time", options.recorder.sim_time,
                "With --remote: times of /clock; of a twin they always are");
  verb.add_flag("--snapshot-mode", options.recorder.snapshot_mode,
                "Keep messages in memory, and write them when /rosbag2_recorder/snapshot is called");
  verb.add_option("--max-cache-size", options.cache,
                  "Bytes of messages that wait for a snapshot (default 100 MiB)");
  verb.add_option("--node-name", options.node, "The name of its node (default rosbag2_recorder)");
  verb.add_flag("--disable-keyboard-controls", options.no_keys, "No keys");
  verb.add_flag("--no-ros", options.no_ros, "No services on the ROS 2 network");
}

// Options of ros2 bag record.
constexpr ForeignOption kForeignToRecord[] = {
    {"-p,--polling-interval", 1, "", "topics are found as soon as they are announced"},
    {"--compression-queue-size", 1, "", "chunks are compressed as they are written"},
    {"--compression-threads", 1, "", "chunks are compressed as they are written"},
    {"--compression-threads-priority", 1, "", "chunks are compressed as they are written"},
    {"--log-level", 1, "", "there is one level"},
    {"--qos-profile-overrides-path", 1, "subscriptions have the qualities that the publishers offer",
     "omit it"},
    {"--storage-config-file", 1, "such files are not read",
     "--storage-preset-profile, --compression-format and --max-bag-size choose what can be chosen"},
};

}  // namespace

void add_bag_record(CLI::App& bag, int& exit_code) {
  add_verb<RecordOptions>(
      bag, "record", "Record topics of a running twin or a ROS 2 graph (--remote)",
      "doppel bag record -a -o my_run\n  doppel bag record /joint_states /tf --duration 10\n  doppel bag "
      "record -e 'arm|tf' -x image -b 100000000 --remote\n  doppel bag record -a --start-paused\n  doppel "
      "service call --remote /rosbag2_recorder/resume\nThe services of rosbag2's recorder are those of the "
      "node /rosbag2_recorder on the ROS 2 network: pause, resume, toggle_paused, is_paused, split_bagfile, "
      "snapshot, stop. The space key pauses, too.\nFrom the first step on, so that it can be run again: "
      "doppel up TARGET --record FOLDER",
      exit_code,
      [](CLI::App& verb, RecordOptions& options) {
        declare_topics(verb, options);
        declare_output(verb, options);
        declare_run(verb, options);
        add_foreign_options(verb, kForeignToRecord);
      },
      run_record);
}

void add_bag_snapshot(CLI::App& bag, int& exit_code) {
  add_verb<NoOptions>(
      bag, "snapshot", "Write the last half minute of a running twin as a bag, and print its folder",
      "doppel bag snapshot\n  doppel bag info $(doppel bag snapshot)\nA twin also writes it by itself: after "
      "the "
      "emergency stop, an error, a divergence, and commands beyond a limit",
      exit_code, [](CLI::App&, NoOptions&) {}, run_snapshot);
}

}  // namespace doppel::app
