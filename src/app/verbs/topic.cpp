#include <algorithm>
#include <cmath>
#include <deque>

#include "app/verbs/field_value.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/core/names.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kForever = std::chrono::hours(24 * 365);

struct ListOptions {
  bool types = false, verbose = false, hidden = false, count = false;
};

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

void list_verbose(Client& twin, const ListOptions& options, bool published) {
  say("{} topics:\n", published ? "Published" : "Subscribed");
  for (const auto& [name, topic] : twin.topics()) {
    const auto& nodes = published ? topic.publishers : topic.subscribers;
    if (nodes.empty() || (is_hidden(name) && !options.hidden)) continue;
    say(" * {} [{}] {}\n", name, topic.type, counted(nodes.size(), published ? "publisher" : "subscriber"));
  }
}

int list_topics(Shell& shell, const ListOptions& options) {
  Client& twin = shell.twin();
  if (options.verbose) {
    list_verbose(twin, options, true);
    say("\n");
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
      say("{} [{}]\n", name, topic.type);
    } else {
      say("{}\n", name);
    }
  }
  if (options.count) say("{}\n", count);
  return 0;
}

struct EchoOptions {
  std::string topic, field;
  bool once = false;
};

int echo(Shell& shell, const EchoOptions& options) {
  Shell::catch_interrupts();
  try {
    Client& twin = shell.twin();
    const std::string topic = absolute(options.topic);
    const TypeSupport& type = twin.message_type(topic);
    if (!options.field.empty()) {
      if (const Status status = check_field_path(*type.description(), options.field); !status)
        wrong_use(status.why());
    }
    twin.subscribe(topic);
    Client::Received message;
    while (twin.next(message, Clock::now() + kForever)) {
      std::string text;
      const Status status = options.field.empty()
                                ? type.cdr_to_yaml(message.cdr, text)
                                : field_as_yaml(*type.description(), message.cdr, options.field, text);
      if (!status) throw ClientError(status.why());
      say("{}---\n", text);
      if (options.once) break;
    }
  } catch (const Interrupted&) {
    return 0;  // Ctrl-C is how one ends it
  }
  return 0;
}

struct RateOptions {
  std::string topic;
  std::size_t window = 0;
};

// Calls `report` once a second while messages of the topic come; `add` takes each with its time of arrival.
void watch(Shell& shell, const std::string& name,
           const std::function<void(Clock::time_point, std::size_t)>& add,
           const std::function<void()>& report) {
  Shell::catch_interrupts();
  try {
    Client& twin = shell.twin();
    const std::string topic = absolute(name);
    static_cast<void>(twin.find_topic(topic));
    twin.subscribe(topic);
    auto due = Clock::now() + std::chrono::seconds(1);
    bool any = false;
    while (true) {
      Client::Received message;
      if (twin.next(message, due)) {
        add(Clock::now(), message.cdr.size());
        any = true;
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

int hz(Shell& shell, const RateOptions& options) {
  std::deque<double> gaps;
  std::optional<Clock::time_point> before;
  const std::size_t window = options.window > 0 ? options.window : 10'000;
  const auto add = [&](Clock::time_point now, std::size_t) {
    if (before) gaps.push_back(std::chrono::duration<double>(now - *before).count());
    before = now;
    if (gaps.size() > window) gaps.pop_front();
  };
  watch(shell, options.topic, add, [&] {
    if (gaps.empty()) return;
    double sum = 0, squares = 0;
    for (const double gap : gaps) sum += gap;
    const double mean = sum / static_cast<double>(gaps.size());
    for (const double gap : gaps) squares += (gap - mean) * (gap - mean);
    const auto [least, most] = std::ranges::minmax(gaps);
    say("average rate: {:.3f}\n\tmin: {:.3f}s max: {:.3f}s std dev: {:.5f}s window: {}\n", 1 / mean, least,
        most, std::sqrt(squares / static_cast<double>(gaps.size())), gaps.size() + 1);
  });
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
  const auto add = [&](Clock::time_point now, std::size_t size) {
    sizes.emplace_back(now, size);
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
    say("{}/s from {} messages\n\tMessage size mean: {} min: {} max: {}\n", bytes_text(sum / seconds),
        sizes.size(), bytes_text(sum / static_cast<double>(sizes.size())),
        bytes_text(static_cast<double>(least)), bytes_text(static_cast<double>(most)));
  });
  return 0;
}

struct InfoOptions {
  std::string name;
  bool verbose = false;
};

int info(Shell& shell, const InfoOptions& options) {
  const Client::Topic& topic = shell.twin().find_topic(absolute(options.name));
  const auto print_nodes = [&](const char* heading, const std::vector<std::string>& nodes) {
    say("{} count: {}\n", heading, nodes.size());
    if (!options.verbose) return;
    for (const std::string& node : nodes)
      say("  Node name: {}\n  Topic type: {}\n\n", node.substr(1), topic.type);
  };
  say("Type: {}\n", topic.type);
  print_nodes("Publisher", topic.publishers);
  print_nodes("Subscription", topic.subscribers);
  return 0;
}

int print_type(Shell& shell, const InfoOptions& options) {
  say("{}\n", shell.twin().find_topic(absolute(options.name)).type);
  return 0;
}

int find_by_type(Shell& shell, const InfoOptions& options) {
  const TypeSupport& type = known_type(options.name);
  for (const auto& [name, topic] : shell.twin().topics()) {
    if (topic.type == type.name) say("{}\n", name);
  }
  return 0;
}

struct PubOptions {
  std::string topic, type, yaml = "{}";
  bool once = false;
  double rate = 1;
  std::size_t times = 0;
  int wait_for = -1;  // subscribers; -1: one where the number of messages is limited
  double patience = 5;
};

void wait_for_subscribers(Client& twin, const std::string& topic, std::size_t count, double patience) {
  const auto subscribers = [&] {
    const auto found = twin.topics().find(topic);
    return found == twin.topics().end() ? 0 : found->second.subscribers.size();
  };
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience));
  if (subscribers() < count)
    print_note(fmt::format("waiting for {} on {} ...", counted(count, "subscriber"), topic));
  if (twin.wait_until([&] { return subscribers() >= count; }, until)) return;
  std::vector<std::string> heard;
  for (const auto& [name, entry] : twin.topics()) {
    if (!entry.subscribers.empty() && !is_hidden(name)) heard.push_back(name);
  }
  throw ClientError(subscribers() > 0
                        ? fmt::format("only {} on {}", counted(subscribers(), "subscriber"), topic)
                        : fmt::format("no subscriber on {}{}", topic, did_you_mean(topic, heard)));
}

int pub(Shell& shell, const PubOptions& options) {
  const TypeSupport& type = known_type(options.type);
  const Bytes cdr = to_request(type, options.yaml);
  const std::string topic = absolute(options.topic);
  Client& twin = shell.twin();
  const auto known = twin.topics().find(topic);
  if (known != twin.topics().end() && !known->second.type.empty() && known->second.type != type.name) {
    wrong_use(fmt::format("{} is a {}, not a {}", topic, known->second.type, type.name));
  }
  const std::size_t times = options.once ? 1 : options.times;
  const std::size_t wanted =
      options.wait_for >= 0 ? static_cast<std::size_t>(options.wait_for) : (times > 0 ? 1 : 0);
  if (wanted > 0) wait_for_subscribers(twin, topic, wanted, options.patience);
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

void declare_name(CLI::App& verb, InfoOptions& options) {
  verb.add_option("topic", options.name, "Name of the topic")->required();
}

void add_rates(CLI::App& group, int& exit_code) {
  const auto declare = [](CLI::App& verb, RateOptions& options) {
    verb.add_option("topic", options.topic, "Name of the topic")->required();
    verb.add_option("-w,--window", options.window, "Messages to look back on")->check(CLI::PositiveNumber);
  };
  add_verb<RateOptions>(group, "hz", "How often messages arrive", "doppel topic hz /joint_states", exit_code,
                        declare, hz);
  add_verb<RateOptions>(group, "bw", "How many bytes arrive", "doppel topic bw /tf", exit_code, declare, bw);
}

void add_pub(CLI::App& group, int& exit_code) {
  add_verb<PubOptions>(
      group, "pub", "Publish a message", R"(doppel topic pub --once /omarm_arm_controller/joint_trajectory \
    trajectory_msgs/msg/JointTrajectory \
    '{joint_names: ["Revolute 1"], points: [{positions: [1.2], time_from_start: {sec: 3}}]}')",
      exit_code,
      [](CLI::App& verb, PubOptions& options) {
        verb.add_option("topic", options.topic, "Name of the topic")->required();
        verb.add_option("type", options.type, "Type of the message")->required();
        verb.add_option("values", options.yaml, "The message as YAML; what is left out keeps its default");
        verb.add_flag("-1,--once", options.once, "Publish once, when there is a subscriber");
        verb.add_option("-r,--rate", options.rate, "Messages per second (default 1)")
            ->check(CLI::PositiveNumber);
        verb.add_option("-t,--times", options.times, "Publish so many messages");
        verb.add_option("-w,--wait-matching-subscriptions", options.wait_for,
                        "Wait for so many subscribers first")
            ->check(CLI::NonNegativeNumber);
        verb.add_option("--max-wait-time-secs", options.patience, "How long to wait for them (default 5)")
            ->check(CLI::PositiveNumber);
      },
      pub);
}

}  // namespace

void add_topic(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "topic", "See and send messages");
  add_verb<ListOptions>(
      group, "list", "The topics there are", "doppel topic list -t", exit_code,
      [](CLI::App& verb, ListOptions& options) {
        verb.add_flag("-t,--show-types", options.types, "With their types");
        verb.add_flag("-v,--verbose", options.verbose,
                      "With types and numbers of publishers and subscribers");
        verb.add_flag("-c,--count-topics", options.count, "Only their number");
        verb.add_flag("-a,--include-hidden-topics", options.hidden, "Those of actions too");
      },
      list_topics);
  add_verb<EchoOptions>(
      group, "echo", "Print messages as they come", "doppel topic echo /joint_states --field position",
      exit_code,
      [](CLI::App& verb, EchoOptions& options) {
        verb.add_option("topic", options.topic, "Name of the topic")->required();
        verb.add_flag("--once", options.once, "Print one message and end");
        verb.add_option("--field", options.field,
                        "Only this field: position, header.stamp, transforms[0].child_frame_id");
      },
      echo);
  add_rates(group, exit_code);
  add_verb<InfoOptions>(
      group, "info", "Type, publishers and subscribers of a topic", "doppel topic info /joint_states -v",
      exit_code,
      [](CLI::App& verb, InfoOptions& options) {
        declare_name(verb, options);
        verb.add_flag("-v,--verbose", options.verbose, "Name the nodes");
      },
      info);
  add_verb<InfoOptions>(group, "type", "The type of a topic", "doppel topic type /tf", exit_code,
                        declare_name, print_type);
  add_verb<InfoOptions>(
      group, "find", "The topics of a type", "doppel topic find sensor_msgs/msg/JointState", exit_code,
      [](CLI::App& verb, InfoOptions& options) {
        verb.add_option("type", options.name, "Type of messages")->required();
      },
      find_by_type);
  add_pub(group, exit_code);
}

}  // namespace doppel::app
