// doppel sensor: the sensors of a running twin, their rates and their data.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/number_checks.h"
#include "app/output.h"
#include "app/verbs/saved_message.h"
#include "app/verbs/sensor_verbs.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/ros/messages/doppel_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
using doppel_msgs::msg::Sensor;
using doppel_msgs::msg::Sensors;

constexpr auto kAnswerTime = std::chrono::seconds(5);

// The sensor with this whole name, or with this last part of its name where that is unique.
Sensor sensor_named(Client& twin, const std::string& name) {
  const Sensors all = sensors_of(twin);
  std::vector<const Sensor*> found;
  std::vector<std::string> names;
  for (const Sensor& sensor : all.sensors) {
    names.push_back(sensor.name);
    if (sensor.name == name) return sensor;
    if (sensor.name.ends_with("/" + name)) found.push_back(&sensor);
  }
  if (found.size() == 1) return *found.front();
  if (found.empty())
    throw_usage_error(fmt::format("there is no sensor '{}'{}", name, did_you_mean(name, names)));
  std::string which;
  for (const Sensor* sensor : found) which += " " + sensor->name;
  throw_usage_error(fmt::format("'{}' is the name of several sensors:{}", name, which), "name one of them");
}

// The next message of a topic: those of topics that were read before may still come.
bool next_of(Client& twin, const std::string& topic, Client::Received& message, Clock::time_point until) {
  while (twin.next(message, until))
    if (message.topic == topic) return true;
  return false;
}

std::string rate_text(double rate) {
  return rate > 0 ? fmt::format("{:.4g} Hz", rate) : "every step";
}

nlohmann::json to_json(const Sensor& sensor) {
  return {{"name", sensor.name},       {"type", sensor.type},         {"topics", sensor.topics},
          {"frame", sensor.frame},     {"rate", sensor.rate},         {"reached", sensor.reached},
          {"samples", sensor.samples}, {"left_out", sensor.left_out}, {"cost", sensor.cost}};
}

struct SensorListOptions {
  bool json = false;
};

int list_sensors(Shell& shell, const SensorListOptions& options) {
  const Sensors all = sensors_of(shell.twin());
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const Sensor& sensor : all.sensors) list.push_back(to_json(sensor));
    print_out(list.dump(2) + "\n");
    return 0;
  }
  if (all.sensors.empty()) {
    print_note("this twin has no sensors; <sensor> in <gazebo reference=\"link\"> adds one");
    return 0;
  }
  std::size_t name = 4, type = 4;
  for (const Sensor& sensor : all.sensors) {
    name = std::max(name, sensor.name.size());
    type = std::max(type, sensor.type.size());
  }
  print_line("{:<{}}  {:<{}}  {:>10}  {:>10}  {:>8}  topics\n", "name", name, "type", type, "rate",
             "measured", "dropped");
  for (const Sensor& sensor : all.sensors) {
    print_line("{:<{}}  {:<{}}  {:>10}  {:>10}  {:>8}  {}\n", sensor.name, name, sensor.type, type,
               rate_text(sensor.rate),
               sensor.reached > 0 ? fmt::format("{:.4g} Hz", sensor.reached) : "not read", sensor.left_out,
               fmt::join(sensor.topics, " "));
  }
  return 0;
}

struct SensorOptions {
  std::string name, file;
  int messages = 100;
};

Time stamp_of(const Client::Received& message) {
  return from_msg(decode<builtin_interfaces::msg::Time>(
      std::span(message.cdr).first(std::min<std::size_t>(message.cdr.size(), 12))));
}

// Hz, from a straight line through the samples, because each stamp is on the nearest step of the physics.
double rate_of(const std::vector<double>& times) {
  const auto n = static_cast<double>(times.size());
  double mean = 0, spread = 0, product = 0;
  for (const double time : times) mean += time / n;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double from_middle = static_cast<double>(i) - (n - 1) / 2;
    spread += from_middle * from_middle;
    product += from_middle * (times[i] - mean);
  }
  return spread / product;
}

int sensor_rate(Shell& shell, const SensorOptions& options) {
  Client& twin = shell.twin();
  const Sensor sensor = sensor_named(twin, options.name);
  const std::string& topic = sensor.topics.front();
  twin.subscribe(topic);
  Shell::catch_interrupts();
  std::vector<double> times;  // s since the first
  std::optional<Time> first;
  try {
    Client::Received message;
    while (times.size() <= static_cast<std::size_t>(options.messages) &&
           next_of(twin, topic, message, Clock::now() + kAnswerTime)) {
      const Time stamp = stamp_of(message);
      if (!first) first = stamp;
      times.push_back(to_seconds(stamp - *first));
    }
  } catch (const Interrupted&) {
    // The messages received so far are printed.
  }
  if (times.size() < 2) throw ClientError(fmt::format("{} brought {} messages in 5 s", topic, times.size()));
  print_line("{}: {:.3f} Hz of simulated time over {} samples; {} asked for\n", sensor.name, rate_of(times),
             times.size(), rate_text(sensor.rate));
  return 0;
}

}  // namespace

Sensors sensors_of(Client& twin) {
  if (!twin.topics().contains(kSensorList)) return {};
  twin.subscribe(kSensorList);
  Client::Received message;
  if (!next_of(twin, kSensorList, message, Clock::now() + kAnswerTime))
    throw ClientError("the twin does not list its sensors");
  twin.unsubscribe(kSensorList);
  return decode<Sensors>(message.cdr);
}

int save_topic(Shell& shell, const TopicFinder& find_topic, const std::string& named) {
  check_output(named);
  Client& twin = shell.twin();
  const std::string topic = find_topic(twin);
  const TypeSupport& type = twin.message_type(topic);
  std::string file = named;
  if (file.empty()) {
    file = topic.substr(1) + usual_ending(type.name);
    std::replace(file.begin(), file.end(), '/', '_');
    check_output(file);
  }
  std::string ending = ending_of(file);
  if (file == "-" || ending.empty()) ending = usual_ending(type.name);
  check_ending(type.name, ending);
  twin.subscribe(topic);
  Client::Received message;
  if (!next_of(twin, topic, message, Clock::now() + kAnswerTime))
    throw ClientError(fmt::format("nothing was published on {} within 5 s", topic));
  std::string note;
  deliver(saved_message(type, message.cdr, ending, note), file);
  if (file != "-") print_note(fmt::format("{} ({}){}", file, type.name, note.empty() ? "" : ": " + note));
  return 0;
}

void add_sensor(CLI::App& app, int& exit_code) {
  CLI::App& group =
      add_group(app, "sensor", "List sensors of a twin, measure their rates, save their data",
                "doppel sensor list\n  doppel sensor hz camera\n  doppel sensor save camera picture.png");
  add_verb<SensorListOptions>(
      group, "list", "List sensors with their rates and topics", "doppel sensor list", exit_code,
      [](CLI::App& verb, SensorListOptions& options) {
        verb.add_flag("--json", options.json, "Print a JSON list to stdout, in Hz, s");
      },
      list_sensors);
  add_verb<SensorCheckOptions>(
      group, "check", "Read a message of every topic, and print what is in it", "doppel sensor check",
      exit_code,
      [](CLI::App& verb, SensorCheckOptions& options) {
        verb.add_option("--wait", options.wait,
                        "Minimum seconds for each sensor; its period in simulated time is waited for, up to "
                        "120 s (default 5)")
            ->check(positive_number());
        verb.add_flag("--json", options.json, "Print a JSON list to stdout");
      },
      check_sensors);
  const auto name = [](CLI::App& verb, SensorOptions& options) {
    verb.add_option("sensor", options.name, "Its name, or the last part of it")->required();
  };
  add_verb<SensorOptions>(
      group, "hz", "Measure the rate by the stamps of its samples", "doppel sensor hz camera", exit_code,
      [name](CLI::App& verb, SensorOptions& options) {
        name(verb, options);
        verb.add_option("-n,--samples", options.messages, "Number of samples (default 100)")
            ->check(positive_number());
      },
      sensor_rate);
  add_verb<SensorOptions>(
      group, "save", "Save one sample: a picture, a point cloud, a scan",
      "doppel sensor save camera picture.png", exit_code,
      [name](CLI::App& verb, SensorOptions& options) {
        name(verb, options);
        verb.add_option("file", options.file, "File: .png .jpg .ply .csv .yaml (default: by the topic)");
      },
      [](Shell& shell, const SensorOptions& options) {
        const auto topic = [&](Client& twin) { return sensor_named(twin, options.name).topics.front(); };
        return save_topic(shell, topic, options.file);
      });
}

}  // namespace doppel::app
