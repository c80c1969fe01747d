// `doppel teleop`: drives the robot's base by keys, by a joystick, or on the page.
#include "app/browser.h"
#include "app/number_checks.h"
#include "app/verbs/teleop_options.h"
#include "app/verbs/verbs.h"

namespace doppel::app {
namespace {

// The page's tab with the pad.
int page(Shell& shell, const NoOptions& /*options*/) {
  const std::string url = shell.page_url() + "#drive";
  print_out(url + "\n");
  const Log log;
  Browser(log).open(url);
  return 0;
}

void declare_common(CLI::App& verb, TeleopOptions& options) {
  verb.add_flag("--no-ros", options.no_ros,
                "Keep the verb's nodes and their parameters off the ROS 2 network");
  verb.add_option("topic", options.topic, "Topic of velocities (default: the one that the base reads)");
  verb.add_option("--type", options.type, "Type of the messages (default: the topic's)")
      ->check(CLI::IsMember({"auto", "stamped", "twist"}));
  verb.add_option("--frame-id", options.frame, "Frame in the header of TwistStamped");
}

void declare_keyboard(CLI::App& verb, TeleopOptions& options) {
  declare_common(verb, options);
  const auto positive = positive_number();
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

void add_teleop(CLI::App& app, const RosArguments& ros, int& exit_code) {
  CLI::App& group = add_group(app, "teleop", "Drive the robot's base by keys, a joystick, or on the page",
                              "doppel teleop keyboard\n  doppel teleop joy --calibrate");
  add_verb<TeleopOptions>(
      group, "keyboard", "Use the keys of teleop_twist_keyboard; 1 to 9 move joints of an arm",
      "doppel teleop keyboard\n  doppel teleop keyboard /base_controller/cmd_vel --speed 0.3", exit_code,
      [&ros](CLI::App& verb, TeleopOptions& options) {
        declare_keyboard(verb, options);
        options.ros = &ros;
      },
      teleop_keyboard);
  add_verb<TeleopOptions>(
      group, "joy", "A joystick, with the parameters of joy and teleop_twist_joy",
      "doppel teleop joy --calibrate\n  doppel teleop joy --config ps3.yaml", exit_code,
      [&ros](CLI::App& verb, TeleopOptions& options) {
        declare_joystick(verb, options);
        options.ros = &ros;
      },
      teleop_joy);
  add_verb<NoOptions>(
      group, "page", "Print the address of the page's pad, and open it on a desktop", "doppel teleop page",
      exit_code, [](CLI::App&, NoOptions&) {}, page);
}

}  // namespace doppel::app
