// doppel bag record: the topics of a running twin, or of a ROS 2 graph, as a bag.

#include <unistd.h>

#include <algorithm>
#include <map>

#include "app/number_checks.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{100};   // for new topics
constexpr std::chrono::milliseconds kFlush{500};  // what a killed recorder loses at most
constexpr std::chrono::seconds kReport{1};

struct RecordOptions {
  TopicSelection topics;
  BagOutput output;
  double duration = 0;  // s; 0: until Ctrl-C
  std::string storage;
};

// The protocol of a twin does not carry qualities, so that a topic is latched by its name there.
bool is_latched(const std::string& name, const Client::Topic& topic) {
  for (const Client::Endpoint& end : topic.publisher_ends) {
    for (const auto& [policy, value] : end.qos) {
      if (policy == "Durability") return value == "TRANSIENT_LOCAL";
    }
  }
  constexpr const char* kLatched[] = {"/tf_static", "/robot_description", "/robot_description_semantic",
                                      "/map",       "/doppel/scene",      "/doppel/sensors"};
  return std::ranges::any_of(kLatched, [&](const char* latched) { return name.ends_with(latched); });
}

Qos qos_of(const std::string& name, const Client::Topic& topic) {
  Qos out;
  out.latched = is_latched(name, topic);
  for (const Client::Endpoint& end : topic.publisher_ends) {
    for (const auto& [policy, value] : end.qos)
      out.best_effort = out.best_effort || (policy == "Reliability" && value == "BEST_EFFORT");
  }
  if (out.latched) out.depth = 1;
  return out;
}

class ClientRecorder {
 public:
  ClientRecorder(Client& client, const RecordOptions& options)
      : client_(client), options_(options), writer_(writer_options(options.output)) {}

  void run() {
    const auto begin = Clock::now();
    const auto end = options_.duration > 0 ? begin + std::chrono::duration_cast<Clock::duration>(
                                                         std::chrono::duration<double>(options_.duration))
                                           : begin + kForever;
    auto flush = begin + kFlush, report = begin + kReport;
    while (Clock::now() < end) {
      subscribe();
      Client::Received message;
      if (client_.next(message, std::min(end, Clock::now() + kLook))) record(message);
      if (Clock::now() >= flush) {
        writer_.sync();
        flush = Clock::now() + kFlush;
      }
      if (Clock::now() >= report) {
        show(Clock::now() - begin);
        report = Clock::now() + kReport;
      }
    }
  }
  void close() { writer_.close(); }
  [[nodiscard]] const BagWriter& writer() const { return writer_; }

 private:
  void subscribe() {
    for (const auto& [name, topic] : client_.topics()) {
      if (recorded_.contains(name) || topic.publishers.empty() || topic.type.empty() ||
          !options_.topics.selects(name, topic.type))
        continue;
      recorded_[name] = writer_.add_topic(described(name, topic));
      client_.subscribe(name);
    }
  }

  RecordedTopic described(const std::string& name, const Client::Topic& topic) {
    RecordedTopic out;
    out.name = name;
    out.type = topic.type;
    const Qos qos = qos_of(name, topic);
    out.latched = qos.latched ? std::max<std::size_t>(1, topic.publishers.size()) : 0;
    out.qos = offered_qos_text({qos});
    out.schema = topic.schema;
    if (const TypeSupport* const type = find_type(topic.type)) {
      if (out.schema.empty()) out.schema = type->schema();
      out.type_hash = type->hash();
    }
    for (const Client::Endpoint& publisher : topic.publisher_ends) {
      if (!publisher.type_hash.empty()) out.type_hash = publisher.type_hash;
    }
    return out;
  }

  void record(const Client::Received& message) {
    const auto found = recorded_.find(message.topic);
    if (found == recorded_.end()) return;
    // A latched message is older than what came before it; a reset of the simulation is told apart by its
    // size.
    constexpr std::int64_t kSetBack = 1'000'000'000;
    const std::int64_t stamp = std::max<std::int64_t>(0, nanoseconds_of(message.stamp));
    const bool clock = message.topic == "/clock" && stamp + kSetBack < time_;
    time_ = clock ? stamp : std::max(time_, stamp);
    writer_.write(found->second, 0, static_cast<std::uint64_t>(time_), static_cast<std::uint64_t>(stamp),
                  message.cdr);
  }

  void show(Clock::duration since) const {
    if (isatty(STDERR_FILENO) == 0) return;
    fmt::print(stderr, "\r{:.0f} s, {} topics, {} messages, {}   ",
               std::chrono::duration<double>(since).count(), recorded_.size(), writer_.metadata().messages,
               size_text(writer_.size()));
  }

  Client& client_;
  const RecordOptions& options_;
  BagWriter writer_;
  std::map<std::string, std::size_t> recorded_;  // the writer's topics
  std::int64_t time_ = 0;
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

int run_record(Shell& shell, const RecordOptions& options) {
  options.topics.check();
  Shell::catch_interrupts();
  RecordOptions chosen = options;
  if (chosen.output.folder.empty()) chosen.output.folder = dated_bag_folder(".").lexically_normal().string();
  Client& client = shell.twin();
  publish_service_calls(client, options.topics);
  ClientRecorder recorder(client, chosen);
  print_note(fmt::format("recording to {}; Ctrl-C ends it", chosen.output.folder));
  std::string failure;
  try {
    recorder.run();
  } catch (const Interrupted&) {
    failure.clear();  // the normal end
  } catch (const ClientError& error) {
    failure = error.what();
  }
  Shell::clear_interrupt();
  recorder.close();
  if (isatty(STDERR_FILENO) != 0) print_note("");
  const BagMetadata& recorded = recorder.writer().metadata();
  if (recorded.messages > 0)
    print_line("{}: {} messages, {}\n", chosen.output.folder, recorded.messages,
               size_text(recorder.writer().size()));
  if (recorded.messages == 0) {
    std::filesystem::remove_all(chosen.output.folder);
    print_note("no message came, so that there is no bag; doppel topic list has the topics");
    return 1;
  }
  if (failure.empty()) return 0;
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

void add_bag_record(CLI::App& bag, int& exit_code) {
  add_verb<RecordOptions>(
      bag, "record", "Record topics of a running twin or a ROS 2 graph (--remote)",
      "doppel bag record -a -o my_run\n  doppel bag record /joint_states /tf --duration 10\n  doppel bag "
      "record -e "
      "'arm|tf' -x image -b 100000000 --remote\nFrom the first step on, so that it can be run again: doppel "
      "up TARGET "
      "--record FOLDER",
      exit_code,
      [](CLI::App& verb, RecordOptions& options) {
        verb.add_option("topics", options.topics.topics, "Topics (default: all)");
        verb.add_flag("-a,--all", options.topics.all, "All topics, services and actions");
        verb.add_flag("--all-topics", options.topics.all_topics, "All topics");
        verb.add_flag("--all-services", options.topics.all_services, "The calls of all services");
        verb.add_flag("--all-actions", options.topics.all_actions, "All actions");
        verb.add_flag("--include-hidden-topics", options.topics.hidden, "Hidden topics, too");
        add_topic_options(verb, options.topics);
        add_output_options(verb, options.output, false);
        verb.add_option("--duration", options.duration, "Seconds after which it ends (default: until Ctrl-C)")
            ->check(positive_number());
        verb.add_option("-s,--storage", options.storage, "The storage of the bag: mcap")
            ->check(CLI::IsMember({"mcap"}));
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
