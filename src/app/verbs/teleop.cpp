// `doppel teleop`: drives the robot's base by keys, by a joystick, or on the page.

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "app/browser.h"
#include "app/verbs/joy_settings.h"
#include "app/verbs/joystick.h"
#include "app/verbs/raw_terminal.h"
#include "app/verbs/teleop_arm.h"
#include "app/verbs/teleop_keys.h"
#include "app/verbs/velocity_topic.h"
#include "app/verbs/verbs.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;
using Steady = std::chrono::steady_clock;

constexpr double kKeyRate = 20;     // Hz
constexpr int kStopsAtRelease = 3;  // messages; one of them could be lost on a network

struct TeleopOptions {
  std::string topic, frame, type = "auto";
  KeySettings keys;
  double joint_speed = 0.5;
  std::string device, config;
  bool calibrate = false;
};

std::optional<bool> asked_stamped(const TeleopOptions& options) {
  if (options.type == "auto") return std::nullopt;
  return options.type == "stamped";
}

Steady::duration seconds_of(double seconds) {
  return std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(seconds));
}

VelocityPublisher open_velocity(Client& twin, const TeleopOptions& options) {
  const VelocityTopic topic = find_velocity_topic(twin, options.topic, asked_stamped(options));
  print_note(fmt::format("driving by {} ({})", topic.name, topic.stamped ? "TwistStamped" : "Twist"));
  return {twin, topic, options.frame};
}

// Sends zeros when it ends, also by Ctrl-C or an error, so that no base drives on.
class StopAtExit {
 public:
  explicit StopAtExit(VelocityPublisher& base) : base_(base) {}
  ~StopAtExit() {
    Shell::clear_interrupt();
    try {
      base_.send({});
    } catch (...) {  // the twin is gone, and with it the base
    }
  }
  StopAtExit(const StopAtExit&) = delete;
  StopAtExit& operator=(const StopAtExit&) = delete;

 private:
  VelocityPublisher& base_;
};

void report_key(const TeleopKeys& keys, KeyEffect effect, const TeleopArm& arm, KeyTime now) {
  if (effect == KeyEffect::speed)
    print_note(fmt::format("currently: speed {:.3g} turn {:.3g}", keys.speed(), keys.turn()));
  if (effect == KeyEffect::reverse) print_note(keys.direction() > 0 ? "joints: forward" : "joints: backward");
  if (effect != KeyEffect::joint) return;
  const auto index = static_cast<std::size_t>(keys.joint(now)->joint);
  if (index >= arm.joints().size()) print_note(fmt::format("there is no joint {}", index + 1));
}

int keyboard(Shell& shell, const TeleopOptions& options) {
  Client& twin = shell.twin();
  TeleopArm arm(twin);
  std::optional<VelocityPublisher> base;
  try {
    base.emplace(open_velocity(twin, options));
  } catch (const ClientError&) {
    if (arm.joints().empty() || !options.topic.empty()) throw;  // an arm without a base can be moved
    print_note("no base: 1 to 9 move the joints of the arm");
  }
  print_note(teleop_help());
  TeleopKeys keys(options.keys);
  print_note(fmt::format("currently: speed {:.3g} turn {:.3g}", keys.speed(), keys.turn()));
  Shell::catch_interrupts();
  RawTerminal terminal(STDIN_FILENO);
  std::optional<StopAtExit> stop_at_exit;
  if (base) stop_at_exit.emplace(*base);
  const auto receive = [&] {
    Client::Received message;
    if (base) {
      base->receive([&](const auto& received) { arm.take(received); });
    } else {
      twin.sync();
      while (twin.next(message, Steady::now())) arm.take(message);
    }
  };
  const auto period = seconds_of(1 / kKeyRate);
  int stops_left = 0;
  bool arm_moved = false;
  auto due = Steady::now();
  while (!Shell::interrupted() && !terminal.has_ended()) {
    const auto key = terminal.next(due);
    const KeyTime now = Steady::now();
    if (key) {
      const KeyEffect effect = keys.press(*key, now);
      if (effect == KeyEffect::quit) break;
      report_key(keys, effect, arm, now);
      if (effect == KeyEffect::motion) due = now;  // a key acts at once
      if (effect == KeyEffect::motion || effect == KeyEffect::joint) stops_left = kStopsAtRelease;
    }
    if (now < due) continue;
    due = now + period;
    receive();
    const auto joint = keys.joint(now);
    if (joint) {
      arm.move(static_cast<std::size_t>(joint->joint), joint->direction * options.joint_speed, 1 / kKeyRate);
      arm_moved = true;
    } else if (std::exchange(arm_moved, false)) {
      arm.stop();
    }
    const bool drives = keys.is_down(now) && !joint;
    if (base && (drives || stops_left > 0)) base->send(keys.twist(now));
    stops_left = drives ? kStopsAtRelease : std::max(0, stops_left - 1);
  }
  return 0;
}

JoySettings joy_settings(const TeleopOptions& options) {
  if (!options.config.empty()) return read_joy_settings(options.config);
  std::error_code none;
  if (!options.calibrate && fs::exists(own_joy_file(), none)) {
    print_note(fmt::format("settings of {}", own_joy_file().string()));
    return read_joy_settings(own_joy_file());
  }
  return {};
}

int calibrate(Joystick& joystick, const JoySettings& before, const TeleopOptions& options) {
  Shell::catch_interrupts();
  const JoySettings settings = calibrate_joystick(joystick, before);
  const fs::path file = options.config.empty() ? own_joy_file() : fs::path(options.config);
  std::error_code none;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), none);
  std::ofstream out(file);
  out << to_yaml(settings);
  if (!out.flush()) throw ClientError(fmt::format("{} cannot be written", file.string()));
  print_note(fmt::format("written: {}", file.string()));
  return 0;
}

int joy(Shell& shell, const TeleopOptions& options) {
  const bool fresh = options.calibrate && !options.config.empty() && !fs::exists(options.config);
  const JoySettings settings = fresh ? JoySettings{} : joy_settings(options);
  Joystick joystick(options.device.empty() ? Joystick::find() : options.device, settings.deadzone);
  if (options.calibrate) return calibrate(joystick, settings, options);
  VelocityPublisher base = open_velocity(shell.twin(), options);
  if (settings.require_enable_button) {
    print_note(fmt::format("hold button {} to drive{}; Ctrl-C: end", settings.enable_button,
                           settings.enable_turbo_button < 0
                               ? ""
                               : fmt::format(", button {} to drive fast", settings.enable_turbo_button)));
  }
  Shell::catch_interrupts();
  const StopAtExit stop_at_exit(base);
  const auto period =
      settings.autorepeat_rate > 0 ? seconds_of(1 / settings.autorepeat_rate) : std::chrono::hours(1);
  bool stopped = true;
  auto due = Steady::now();
  while (!Shell::interrupted() && !joystick.has_ended()) {
    const bool changed = joystick.wait(due);
    const auto now = Steady::now();
    if (!changed && now < due) continue;
    if (now >= due) due = now + period;
    base.receive();
    const bool enabled = is_enabled(settings, joystick.buttons());
    if (!enabled && stopped) continue;
    base.send(joy_twist(settings, joystick.axes(), joystick.buttons()));
    stopped = !enabled;
  }
  if (joystick.has_ended()) print_note("the joystick has been unplugged; the base stops");
  return 0;
}

// The page's tab with the pad.
int page(Shell& shell, const NoOptions& /*options*/) {
  const std::string url = shell.page_url() + "#drive";
  print_out(url + "\n");
  const Log log;
  Browser(log).open(url);
  return 0;
}

void declare_common(CLI::App& verb, TeleopOptions& options) {
  verb.add_option("topic", options.topic, "Topic of velocities (default: the one that the base reads)");
  verb.add_option("--type", options.type, "Type of the messages (default: the topic's)")
      ->check(CLI::IsMember({"auto", "stamped", "twist"}));
  verb.add_option("--frame-id", options.frame, "Frame in the header of TwistStamped");
}

void declare_keyboard(CLI::App& verb, TeleopOptions& options) {
  declare_common(verb, options);
  const auto positive = CLI::PositiveNumber;
  verb.add_option("--speed", options.keys.speed, "Linear speed, m/s (default: 0.5)")->check(positive);
  verb.add_option("--turn", options.keys.turn, "Angular speed, rad/s (default: 1)")->check(positive);
  verb.add_option("--speed-limit", options.keys.speed_limit, "Highest linear speed, m/s")->check(positive);
  verb.add_option("--turn-limit", options.keys.turn_limit, "Highest angular speed, rad/s")->check(positive);
  verb.add_option("--hold", options.keys.first_hold,
                  "Seconds for which a key counts as down before the terminal repeats it (default: 0.7)")
      ->check(positive);
  verb.add_option("--joint-speed", options.joint_speed, "Of the arm's joints, rad/s or m/s (default: 0.5)")
      ->check(positive);
}

void declare_joystick(CLI::App& verb, TeleopOptions& options) {
  declare_common(verb, options);
  verb.add_option("--device", options.device, "The joystick (default: the first /dev/input/js*)");
  verb.add_option("--config", options.config,
                  "Parameters of joy_node and teleop_twist_joy_node (default: ~/.config/doppel/joy.yaml)");
  verb.add_flag("--calibrate", options.calibrate, "Ask for the axes and buttons, and write them to the file");
}

}  // namespace

void add_teleop(CLI::App& app, int& exit_code) {
  CLI::App& group = add_group(app, "teleop", "Drive the robot's base by keys, a joystick, or on the page");
  add_verb<TeleopOptions>(
      group, "keyboard", "Keys as those of teleop_twist_keyboard; 1 to 9 move joints of an arm",
      "doppel teleop keyboard\n  doppel teleop keyboard /base_controller/cmd_vel --speed 0.3", exit_code,
      declare_keyboard, keyboard);
  add_verb<TeleopOptions>(group, "joy", "A joystick, with the parameters of joy and teleop_twist_joy",
                          "doppel teleop joy --calibrate\n  doppel teleop joy --config ps3.yaml", exit_code,
                          declare_joystick, joy);
  add_verb<NoOptions>(
      group, "page", "Print the address of the page's pad, and open it on a desktop", "doppel teleop page",
      exit_code, [](CLI::App&, NoOptions&) {}, page);
}

}  // namespace doppel::app
