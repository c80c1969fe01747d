#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "app/number_checks.h"
#include "app/synonyms.h"
#include "app/verbs/field_value.h"
#include "app/verbs/message_echo.h"
#include "app/verbs/saved_message.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/description/xacro/condition.h"
#include "doppel/ros/bus/twist_conversion.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;

struct ListOptions {
  bool types = false, verbose = false, hidden = false, count = false;
};

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

void list_verbose(Client& twin, const ListOptions& options, bool published) {
  print_line("{} topics:\n", published ? "Published" : "Subscribed");
  for (const auto& [name, topic] : twin.topics()) {
    const auto& nodes = published ? topic.publishers : topic.subscribers;
    if (nodes.empty() || (is_hidden(name) && !options.hidden)) continue;
    print_line(" * {} [{}] {}\n", name, topic.type,
               counted(nodes.size(), published ? "publisher" : "subscriber"));
  }
}

int list_topics(Shell& shell, const ListOptions& options) {
  Client& twin = shell.twin();
  if (options.verbose) {
    list_verbose(twin, options, true);
    print_line("\n");
    list_verbose(twin, options, false);
    return 0;
  }
  std::size_t count = 0;
  for (const auto& [name, topic] : twin.topics()) {
    if ((is_hidden(name) && !options.hidden) || (topic.publishers.empty() && topic.subscribers.empty()))
      continue;
    ++count;
    if (options.count) continue;
    if (options.types) {
      print_line("{} [{}]\n", name, topic.type);
    } else {
      print_line("{}\n", name);
    }
  }
  if (options.count) print_line("{}\n", count);
  return 0;
}

struct EchoOptions {
  std::string topic, filter;
  MessageFormat format;
  bool once = false;
  std::size_t count = 0;  // 0: no end
};

int echo_topic(Shell& shell, const EchoOptions& options) {
  Shell::catch_interrupts();
  const MessageFormat& format = options.format;
  std::optional<Condition> filter;
  if (!options.filter.empty()) filter.emplace(options.filter, "m");
  try {
    Client& twin = shell.twin();
    const std::string topic = absolute(options.topic);
    const TypeSupport& type = twin.message_type(topic);
    if (!format.field.empty()) {
      if (const Status status = check_field_path(*type.description(), format.field); !status)
        throw_usage_error(status.why());
    }
    std::size_t left = options.once ? 1 : options.count;
    twin.subscribe(topic);
    Client::Received message;
    while (twin.next(message, Clock::now() + kForever)) {
      check_same_type(type, message);
      std::string whole;
      if (filter && !(type.cdr_to_yaml(message.cdr, whole) && filter->holds(whole))) continue;
      print_out(echo_text(type, message.cdr, format));
      if (left > 0 && --left == 0) break;
    }
  } catch (const Interrupted&) {
    return 0;  // Ctrl-C is the normal end
  }
  return 0;
}

struct RateOptions {
  std::string topic;
  std::size_t window = 0;
  bool sim_time = false;  // for delay: the present time is that of /clock
};
using Arrival = std::function<void(Clock::time_point, const Client::Received&)>;

// Calls `report` once a second while messages of the topic arrive, and `add` for each with its time of
// arrival, also for those of the topic `also`.
void watch(Shell& shell, const std::string& name, const Arrival& add, const std::function<void()>& report,
           const std::string& also = "") {
  Shell::catch_interrupts();
  try {
    Client& twin = shell.twin();
    const std::string topic = absolute(name);
    static_cast<void>(twin.find_topic(topic));
    twin.subscribe(topic);
    if (!also.empty()) twin.subscribe(also);
    auto due = Clock::now() + std::chrono::seconds(1);
    bool any = false;
    while (true) {
      Client::Received message;
      if (twin.next(message, due)) {
        add(Clock::now(), message);
        any = any || message.topic == topic;
      }
      if (Clock::now() < due) continue;
      if (any) report();
      any = false;
      due += std::chrono::seconds(1);
    }
  } catch (const Interrupted&) {
    return;
  }
}

struct Spread {
  double mean = 0, least = 0, most = 0, deviation = 0;
};

Spread spread_of(const std::deque<double>& values) {
  double sum = 0, squares = 0;
  for (const double value : values) sum += value;
  const double mean = sum / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  const auto [least, most] = std::ranges::minmax(values);
  return {mean, least, most, std::sqrt(squares / static_cast<double>(values.size()))};
}

int hz(Shell& shell, const RateOptions& options) {
  std::deque<double> gaps;
  std::optional<Clock::time_point> before;
  const std::size_t window = options.window > 0 ? options.window : 10'000;
  const auto add = [&](Clock::time_point now, const Client::Received&) {
    if (before) gaps.push_back(std::chrono::duration<double>(now - *before).count());
    before = now;
    if (gaps.size() > window) gaps.pop_front();
  };
  watch(shell, options.topic, add, [&] {
    if (gaps.empty()) return;
    const Spread spread = spread_of(gaps);
    print_line("average rate: {:.3f}\n\tmin: {:.3f}s max: {:.3f}s std dev: {:.5f}s window: {}\n",
               1 / spread.mean, spread.least, spread.most, spread.deviation, gaps.size() + 1);
  });
  return 0;
}

// The stamp of a message that begins with a header.
Time header_stamp(std::span<const std::byte> cdr) {
  constexpr std::size_t kHead = 4;
  return from_msg(decode<builtin_interfaces::msg::Time>(cdr.first(std::min(cdr.size(), kHead + 8))));
}

int delay(Shell& shell, const RateOptions& options) {
  const std::string topic = absolute(options.topic);
  const TypeSupport& type = shell.twin().message_type(topic);
  const auto& fields = type.description()->fields;
  if (fields.empty() || fields.front().type == nullptr ||
      fields.front().type->name != std_msgs::msg::Header::kType)
    throw_usage_error(fmt::format("{} is a {}, which has no header with a stamp", topic, type.name));
  constexpr double kSimulatedDelay = 1e6;  // s: no network, but another clock
  const Client& twin = shell.twin();
  std::deque<double> delays;
  std::optional<Time> clock;
  bool hinted = false;
  const std::size_t window = options.window > 0 ? options.window : 10'000;
  const auto add = [&](Clock::time_point, const Client::Received& message) {
    if (options.sim_time && message.topic == "/clock")
      clock = from_msg(decode<rosgraph_msgs::msg::Clock>(message.cdr).clock);
    if (!options.sim_time) clock = system_time();
    if (!clock || message.topic != topic) return;
    delays.push_back(to_seconds(*clock - header_stamp(message.cdr)));
    if (!options.sim_time && !hinted && std::abs(delays.back()) > kSimulatedDelay &&
        twin.topics().contains("/clock")) {
      hinted = true;
      print_note("note: the stamps are simulated time and the present time is not; add --use-sim-time");
    }
    if (delays.size() > window) delays.pop_front();
  };
  const auto report = [&] {
    if (delays.empty()) return;
    const Spread spread = spread_of(delays);
    print_line("average delay: {:.3f}\n\tmin: {:.3f}s max: {:.3f}s std dev: {:.5f}s window: {}\n",
               spread.mean, spread.least, spread.most, spread.deviation, delays.size());
  };
  watch(shell, topic, add, report, options.sim_time ? "/clock" : "");
  return 0;
}

std::string bytes_text(double bytes) {
  if (bytes >= 1e6) return fmt::format("{:.2f} MB", bytes / 1e6);
  if (bytes >= 1e3) return fmt::format("{:.2f} KB", bytes / 1e3);
  return fmt::format("{:.0f} B", bytes);
}

int bw(Shell& shell, const RateOptions& options) {
  std::deque<std::pair<Clock::time_point, std::size_t>> sizes;
  const std::size_t window = options.window > 0 ? options.window : 100;
  const auto add = [&](Clock::time_point now, const Client::Received& message) {
    sizes.emplace_back(now, message.cdr.size());
    if (sizes.size() > window) sizes.pop_front();
  };
  watch(shell, options.topic, add, [&] {
    double sum = 0;
    std::size_t least = sizes.front().second, most = 0;
    for (const auto& [when, size] : sizes) {
      sum += static_cast<double>(size);
      least = std::min(least, size);
      most = std::max(most, size);
    }
    const double seconds = std::chrono::duration<double>(Clock::now() - sizes.front().first).count();
    print_line("{}/s from {} messages\n\tMessage size mean: {} min: {} max: {}\n", bytes_text(sum / seconds),
               sizes.size(), bytes_text(sum / static_cast<double>(sizes.size())),
               bytes_text(static_cast<double>(least)), bytes_text(static_cast<double>(most)));
  });
  return 0;
}

struct TopicInfoOptions {
  std::string name;
  bool verbose = false;
};

// As rclpy prints a TopicEndpointInfo; fields that the connection does not provide are left out.
void print_end(const Client::Endpoint& end, const char* kind) {
  const std::size_t slash = end.node.rfind('/');
  print_line("Node name: {}\nNode namespace: {}\nTopic type: {}\n", end.node.substr(slash + 1),
             slash == 0 ? "/" : end.node.substr(0, slash), end.type);
  if (!end.type_hash.empty()) print_line("Topic type hash: {}\n", end.type_hash);
  print_line("Endpoint type: {}\n", kind);
  if (!end.gid.empty()) print_line("GID: {}\n", end.gid);
  if (!end.qos.empty()) print_line("QoS profile:\n");
  for (const auto& [name, value] : end.qos) print_line("  {}: {}\n", name, value);
  print_line("\n");
}

int show_topic(Shell& shell, const TopicInfoOptions& options) {
  const Client::Topic& topic = shell.twin().find_topic(absolute(options.name));
  const char* gap = options.verbose ? "\n\n" : "\n";
  print_line("Type: {}{}Publisher count: {}{}", topic.type, gap, topic.publishers.size(), gap);
  for (std::size_t i = 0; options.verbose && i < topic.publisher_ends.size(); ++i)
    print_end(topic.publisher_ends[i], "PUBLISHER");
  print_line("Subscription count: {}{}", topic.subscribers.size(), gap);
  for (std::size_t i = 0; options.verbose && i < topic.subscriber_ends.size(); ++i)
    print_end(topic.subscriber_ends[i], "SUBSCRIPTION");
  return 0;
}

int print_topic_type(Shell& shell, const TopicInfoOptions& options) {
  print_line("{}\n", shell.twin().find_topic(absolute(options.name)).type);
  return 0;
}

int find_topics(Shell& shell, const TopicInfoOptions& options) {
  const TypeSupport& type = known_type(options.name);
  for (const auto& [name, topic] : shell.twin().topics()) {
    if (topic.type == type.name) print_line("{}\n", name);
  }
  return 0;
}

struct SaveOptions {
  std::string topic, file;
};

struct PubOptions {
  std::string topic, type, yaml = "{}";
  bool once = false;
  double rate = 1;
  std::size_t times = 0;
  int wait_for = -1;  // subscribers; -1: one where the number of messages is limited
  double timeout = 5;
};

void wait_for_subscribers(Client& twin, const std::string& topic, std::size_t count, double timeout) {
  const auto subscribers = [&] {
    const auto found = twin.topics().find(topic);
    return found == twin.topics().end() ? 0 : found->second.subscribers.size();
  };
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout));
  if (subscribers() < count)
    print_note(fmt::format("waiting for {} on {} ...", counted(count, "subscriber"), topic));
  if (twin.wait_until([&] { return subscribers() >= count; }, until)) return;
  std::vector<std::string> subscribed;
  for (const auto& [name, entry] : twin.topics()) {
    if (!entry.subscribers.empty() && !is_hidden(name)) subscribed.push_back(name);
  }
  throw ClientError(subscribers() > 0
                        ? fmt::format("only {} on {}", counted(subscribers(), "subscriber"), topic)
                        : fmt::format("no subscriber on {}{}", topic, did_you_mean(topic, subscribed)));
}

// The definition of an unknown type is taken from the subscribers of the topic.
const TypeSupport& type_to_publish(Shell& shell, const std::string& topic, const std::string& name) {
  if (const TypeSupport* known = find_type(name)) return *known;
  if (!replacement_of_ros1_type(name).empty()) return known_type(name);
  const auto& topics = shell.twin().topics();
  const auto there = topics.find(topic);
  return there != topics.end() && there->second.type == name ? shell.twin().message_type(topic)
                                                             : known_type(name);
}

int pub(Shell& shell, const PubOptions& options) {
  const std::string topic = absolute(options.topic);
  const TypeSupport& type = type_to_publish(shell, topic, options.type);
  const Bytes cdr = to_request(type, options.yaml);
  Client& twin = shell.twin();
  const auto known = twin.topics().find(topic);
  const bool is_other_type =
      known != twin.topics().end() && !known->second.type.empty() && known->second.type != type.name;
  if (is_other_type && !is_convertible_twist(type.name, known->second.type)) {  // the twin decides
    throw_usage_error(fmt::format("{} has type {}, not {}", topic, known->second.type, type.name));
  }
  const std::size_t times = options.once ? 1 : options.times;
  const std::size_t wanted =
      options.wait_for >= 0 ? static_cast<std::size_t>(options.wait_for) : (times > 0 ? 1 : 0);
  if (wanted > 0) wait_for_subscribers(twin, topic, wanted, options.timeout);
  Shell::catch_interrupts();
  try {
    auto due = Clock::now();
    const auto period =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / options.rate));
    for (std::size_t i = 1; times == 0 || i <= times; ++i) {
      twin.publish(topic, type.name, cdr);
      twin.sync();
      print_note(fmt::format("publishing #{}: {} {}", i, type.name, options.yaml));
      due += period;
      if (i != times) static_cast<void>(twin.wait_until([] { return false; }, due));
    }
  } catch (const Interrupted&) {
    return 0;
  }
  return 0;
}

void declare_name(CLI::App& verb, TopicInfoOptions& options) {
  verb.add_option("topic", options.name, "Topic name")->required();
}

void add_rates(CLI::App& group, int& exit_code) {
  const auto declare = [](CLI::App& verb, RateOptions& options) {
    verb.add_option("topic", options.topic, "Topic name")->required();
    verb.add_option("-w,--window", options.window, "Window size in messages")->check(positive_number());
  };
  add_verb<RateOptions>(group, "hz", "Print the publishing rate", "doppel topic hz /joint_states", exit_code,
                        declare, hz);
  add_verb<RateOptions>(
      group, "delay", "Print the delay between header stamp and arrival",
      "doppel topic delay -s /joint_states", exit_code,
      [declare](CLI::App& verb, RateOptions& options) {
        declare(verb, options);
        verb.add_flag("-s,--use-sim-time", options.sim_time,
                      "Use /clock as the current time instead of the wall clock");
      },
      delay);
  add_verb<RateOptions>(group, "bw", "Print the bandwidth", "doppel topic bw /tf", exit_code, declare, bw);
}

void add_pub(CLI::App& group, int& exit_code) {
  add_verb<PubOptions>(
      group, "pub", "Publish a message", R"(doppel topic pub --once /omarm_arm_controller/joint_trajectory \
    trajectory_msgs/msg/JointTrajectory \
    '{joint_names: ["Revolute 1"], points: [{positions: [1.2], time_from_start: {sec: 3}}]}')",
      exit_code,
      [](CLI::App& verb, PubOptions& options) {
        verb.add_option("topic", options.topic, "Topic name")->required();
        verb.add_option("type", options.type, "Message type")->required();
        verb.add_option("values", options.yaml, "Message as YAML; omitted fields have their default");
        verb.add_flag("-1,--once", options.once, "Publish once, as soon as there is a subscriber");
        verb.add_option("-r,--rate", options.rate, "Messages per second (default 1)")
            ->check(positive_number());
        verb.add_option("-t,--times", options.times, "Publish this many messages");
        verb.add_option("-w,--wait-matching-subscriptions", options.wait_for,
                        "Wait for this many subscribers first")
            ->check(non_negative_number());
        verb.add_option("--max-wait-time-secs", options.timeout, "Seconds to wait for them (default 5)")
            ->check(positive_number());
      },
      pub);
}

void add_echo(CLI::App& group, int& exit_code) {
  add_verb<EchoOptions>(
      group, "echo", "Print messages",
      "doppel topic echo /joint_states --field position\n  doppel topic echo /joint_states --csv --field "
      "position -n 100 > positions.csv\n  doppel topic echo /joint_states --filter 'm.position[0] > 0.5'",
      exit_code,
      [](CLI::App& verb, EchoOptions& options) {
        verb.add_option("topic", options.topic, "Topic name")->required();
        CLI::Option* const once = verb.add_flag("--once", options.once, "Print one message and exit");
        verb.add_option("-n,--count", options.count, "Print this many messages and exit")
            ->check(positive_number())
            ->excludes(once);
        verb.add_option("--field", options.format.field,
                        "Print only this field: position, header.stamp, transforms[0].child_frame_id");
        verb.add_option(
            "--filter", options.filter,
            "Print only messages for which this Python expression about m is true: 'm.position[0] > "
            "0.5'");
        add_format_options(verb, options.format);
      },
      echo_topic);
}

}  // namespace

void add_topic(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "topic", "List, print and publish topics",
                              "doppel topic list -t\n  doppel topic echo /joint_states --field position\n  "
                              "doppel topic hz /joint_states");
  add_verb<ListOptions>(
      group, "list", "List topics", "doppel topic list -t", exit_code,
      [](CLI::App& verb, ListOptions& options) {
        verb.add_flag("-t,--show-types", options.types, "Show their types");
        verb.add_flag("-v,--verbose", options.verbose,
                      "Show types and numbers of publishers and subscribers");
        verb.add_flag("-c,--count-topics", options.count, "Print only their number");
        verb.add_flag("-a,--include-hidden-topics", options.hidden, "Include those of actions");
      },
      list_topics);
  add_echo(group, exit_code);
  add_rates(group, exit_code);
  add_verb<TopicInfoOptions>(
      group, "info", "Print type, publishers and subscribers of a topic",
      "doppel topic info /joint_states -v", exit_code,
      [](CLI::App& verb, TopicInfoOptions& options) {
        declare_name(verb, options);
        verb.add_flag("-v,--verbose", options.verbose, "Show nodes, QoS and other details of the endpoints");
      },
      show_topic);
  add_verb<TopicInfoOptions>(group, "type", "Print the type of a topic", "doppel topic type /tf", exit_code,
                             declare_name, print_topic_type);
  add_verb<TopicInfoOptions>(
      group, "find", "List the topics of a type", "doppel topic find sensor_msgs/msg/JointState", exit_code,
      [](CLI::App& verb, TopicInfoOptions& options) {
        verb.add_option("type", options.name, "Message type")->required();
      },
      find_topics);
  add_verb<SaveOptions>(
      group, "save", "Save one message: a picture, a point cloud, a scan, or YAML",
      "doppel topic save /camera picture.png", exit_code,
      [](CLI::App& verb, SaveOptions& options) {
        verb.add_option("topic", options.topic, "Topic name")->required();
        verb.add_option("file", options.file, "File: .png .jpg .ply .csv .yaml (default: by the topic)");
      },
      [](Shell& shell, const SaveOptions& options) {
        return save_topic(
            shell, [&](Client&) { return absolute(options.topic); }, options.file);
      });
  add_pub(group, exit_code);
}

}  // namespace doppel::app
