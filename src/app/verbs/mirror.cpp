// doppel mirror: a running arm beside its twin, as a table that is drawn in place.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/server/announcement.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
using doppel_msgs::msg::Mirror;
using doppel_msgs::msg::MirrorJoint;

constexpr const char* kTopic = "/doppel/mirror";
constexpr auto kMirrorPatience = std::chrono::seconds(5);
constexpr auto kDrawing = std::chrono::milliseconds(250);

struct MirrorOptions {
  std::string robot;
  bool once = false, json = false, strict = false;
};

bool has_alarm(const Mirror& mirror) {
  return std::ranges::any_of(mirror.joints, [](const MirrorJoint& one) { return !one.alarm.empty(); });
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("-");
}

std::string percent(double share) {
  return std::isfinite(share) ? fmt::format("{:.0f} %", 100 * share) : std::string("-");
}

// rad or m, ms, shares of the stall torque.
std::vector<std::string> table(const Mirror& mirror) {
  std::size_t name = 5;
  for (const MirrorJoint& one : mirror.joints) name = std::max(name, one.name.size());
  std::vector<std::string> out{
      fmt::format("mirror: {}", mirror.mode),
      fmt::format("{:<{}}  {:>10}  {:>8}  {:>8}  {:>7}  {:>6}  {:>6}  {:>6}", "joint", name, "measured",
                  "twin", "error", "rms", "delay", "load", "twin's")};
  for (const MirrorJoint& one : mirror.joints) {
    const std::string measured = number(one.measured, 3) + (one.believed ? "?" : " ");
    const std::string delay =
        std::isfinite(one.delay) ? fmt::format("{:.0f} ms", 1e3 * one.delay) : std::string("-");
    out.push_back(fmt::format("{:<{}}  {:>10}  {:>8}  {:>8}  {:>7}  {:>6}  {:>6}  {:>6}", one.name, name,
                              measured, number(one.twin, 3), number(one.error, 4), number(one.rms, 4), delay,
                              percent(one.load), percent(one.model_load)));
    if (!one.alarm.empty()) out.push_back("    ALARM " + one.alarm);
    if (one.alarm.empty() && !one.note.empty()) out.push_back("    " + one.note);
  }
  if (std::ranges::any_of(mirror.joints, &MirrorJoint::believed))
    out.emplace_back("?: believed: the command of the servo, and no measurement");
  return out;
}

// Over the former lines, in a terminal.
class Picture {
 public:
  void draw(const std::vector<std::string>& lines) {
    std::string out;
    if (drawn_ > 0) out += fmt::format("\x1b[{}A\x1b[J", drawn_);
    for (const std::string& line : lines) out += line + "\n";
    print_out(out);
    drawn_ = isatty(STDOUT_FILENO) != 0 ? lines.size() : 0;
  }

 private:
  std::size_t drawn_ = 0;
};

// The next message; nullopt: there was none for some seconds.
std::optional<Client::Received> next_of(Client& twin, const std::string& topic) {
  const auto until = Clock::now() + kMirrorPatience;
  Client::Received message;
  while (twin.next(message, until)) {
    if (message.topic == topic) return message;
  }
  return std::nullopt;
}

void print_json(const TypeSupport& type, const Client::Received& message) {
  std::string text;
  if (const Status written = type.cdr_to_json(message.cdr, text); !written) throw ClientError(written.why());
  print_out(text + "\n");
}

// The client of the newest twin of this robot; nullptr: there is no choice.
std::unique_ptr<Client> client_of(const Shell& shell, const std::string& robot) {
  if (robot.empty()) return nullptr;
  std::vector<std::string> names;
  for (const RunningTwin& twin : shell.unselected_twins()) {
    if (twin.robot == robot) return Shell::connect(twin);
    names.push_back(twin.robot);
  }
  if (names.empty()) return nullptr;  // of --port or --remote
  throw_usage_error(fmt::format("no running twin is that of '{}'{}", robot, did_you_mean(robot, names)),
                    "doppel up " + robot + " use_sim:=false");
}

int show_mirror(Shell& shell, const MirrorOptions& options) {
  const std::unique_ptr<Client> chosen = client_of(shell, options.robot);
  Client& twin = chosen ? *chosen : shell.twin();
  const std::string topic = robot_namespace() + kTopic;
  if (!twin.topics().contains(topic))
    throw ClientError(fmt::format(
        "there is no {}: the robot drives no real hardware (doppel up TARGET use_sim:=false)", topic));
  const TypeSupport& type = twin.message_type(topic);
  twin.subscribe(topic);
  Shell::catch_interrupts();
  Picture picture;
  bool alarm = false;
  try {
    auto due = Clock::now();
    while (const auto message = next_of(twin, topic)) {
      if (Clock::now() < due && !options.once) continue;
      due = Clock::now() + kDrawing;
      const auto mirror = decode<Mirror>(message->cdr);
      alarm = has_alarm(mirror);
      if (options.json) {
        print_json(type, *message);
      } else {
        picture.draw(table(mirror));
      }
      if (options.once) return options.strict && alarm ? 1 : 0;
    }
  } catch (const Interrupted&) {
    return options.strict && alarm ? 1 : 0;
  }
  throw ClientError(fmt::format("nothing was published on {} within 5 s", topic));
}

}  // namespace

void add_mirror(CLI::App& app, int& exit_code) {
  add_verb<MirrorOptions>(
      app, "mirror", "Show a running arm beside its twin: the error of each joint, and alarms",
      "doppel mirror\n  doppel mirror my_arm --once --json\n  doppel mirror --once --strict", exit_code,
      [](CLI::App& verb, MirrorOptions& options) {
        verb.add_option("robot", options.robot, "Name of the robot, where several twins run");
        verb.add_flag("--once", options.once, "Print the present state, and end");
        verb.add_flag("--json", options.json, "Print messages of /doppel/mirror as JSON, one a line");
        verb.add_flag("--strict", options.strict, "Exit with code 1 if an alarm is active at the end");
      },
      show_mirror);
}

}  // namespace doppel::app
