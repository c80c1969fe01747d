// `doppel teleop joy`: the nodes joy_node, which publishes the joystick, and teleop_twist_joy_node, which drives.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/description_target.h"
#include "app/verbs/calibrate_joystick.h"
#include "app/verbs/joystick.h"
#include "app/verbs/teleop_options.h"
#include "doppel/base/core/output_file.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;
using Steady = std::chrono::steady_clock;
using sensor_msgs::msg::Joy;

constexpr auto kSpinPeriod = std::chrono::milliseconds(20);  // of requests to the nodes

// The file of parameters that is used; "": none.
std::string joy_file(const TeleopOptions& options) {
  if (!options.config.empty()) return options.config;
  std::error_code none;
  if (!fs::exists(own_joy_file(), none)) return "";
  print_note(fmt::format("settings of {}", own_joy_file().string()));
  return own_joy_file().string();
}

int calibrate(const TeleopOptions& options) {
  const fs::path file = options.config.empty() ? own_joy_file() : fs::path(options.config);
  std::error_code none;
  Diagnostics diagnostics;
  const bool exists = fs::exists(file, none);
  if (exists) check_replaceable(file);
  const JoySettings before = exists ? read_joy_settings(file, diagnostics) : JoySettings();
  Joystick joystick(options.device.empty() ? Joystick::find(before) : options.device);
  joystick.use(before);
  Shell::catch_interrupts();
  const JoySettings settings = calibrate_joystick(joystick, before);
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), none);
  write_whole(file, to_yaml(settings));
  print_note(fmt::format("written: {}", file.string()));
  return 0;
}

// The node that publishes the joystick's state.
class JoyNode {
 public:
  JoyNode(ros2::Context& context, JoySettings& settings) : node_(context, kJoyNode, robot_namespace()) {
    ParameterOverrides written = context.overrides_for(node_.on_bus());
    declare_joy(node_.on_bus(), written, settings);
    report_unused_parameters(written, node_);
    publisher_ = node_.create_publisher<Joy>("joy");
  }
  void publish(Joy joy) {
    joy.header.stamp = to_time_msg(node_.now());
    joy.header.frame_id = "joy";
    publisher_.publish(joy);
  }

 private:
  ros2::Node node_;
  ros2::Publisher<Joy> publisher_;
};

// The node that drives by such messages: those of joy_node, or of any other node on the network.
class TwistJoyNode {
 public:
  TwistJoyNode(ros2::Context& context, Shell& shell, const TeleopOptions& options, JoySettings& settings)
      : settings_(settings), node_(context, kTwistJoyNode, robot_namespace()) {
    ParameterOverrides written = context.overrides_for(node_.on_bus());
    const VelocityTopic topic =
        open_velocity(shell.twin(), node_, options, asked_stamped(options, written, "publish_stamped_twist"));
    if (!options.frame.empty()) settings_.frame = options.frame;
    declare_twist_joy(node_.on_bus(), written, settings_, topic.stamped);
    report_unused_parameters(written, node_);
    base.emplace(shell.twin(), topic, shell.is_remote() ? &node_ : nullptr);
    node_.create_subscription<Joy>("joy", [this](const Joy& joy) { drive(joy); });
  }

  std::optional<VelocityPublisher> base;

 private:
  void drive(const Joy& joy) {
    const bool enabled = is_enabled(settings_, joy);
    if (!enabled && stopped_) return;
    base->set_frame(settings_.frame);
    base->send(joy_twist(settings_, joy));
    stopped_ = !enabled;
  }

  JoySettings& settings_;
  ros2::Node node_;
  bool stopped_ = true;
};

}  // namespace

int teleop_joy(Shell& shell, const TeleopOptions& options) {
  if (options.calibrate) return calibrate(options);
  const auto context = open_context(options, joy_file(options));
  JoySettings settings;
  JoyNode joy(*context, settings);
  Joystick joystick(options.device.empty() ? Joystick::find(settings) : options.device);
  TwistJoyNode twist(*context, shell, options, settings);
  if (settings.require_enable_button) {
    print_note(fmt::format("hold button {} to drive{}; Ctrl-C: end", settings.enable_button,
                           settings.enable_turbo_button < 0
                               ? ""
                               : fmt::format(", button {} to drive fast", settings.enable_turbo_button)));
  }
  Shell::catch_interrupts();
  const StopAtExit stop_at_exit(*twist.base);
  auto last = Steady::now(), due = last;
  while (!Shell::interrupted() && !joystick.has_ended()) {
    joystick.use(settings);
    const JoystickChange change = joystick.wait(std::min(due, Steady::now() + kSpinPeriod));
    const auto now = Steady::now();
    twist.base->receive();
    if (change.axes) due = std::min(due, now + std::chrono::milliseconds(settings.coalesce_interval_ms));
    if (change.buttons || now >= due) {
      joy.publish(joystick.values());
      last = now;
      due = next_repetition(settings, last);
    }
    due = std::min(due, next_repetition(settings, last));  // the parameter may have changed
    context->spin_some();
  }
  if (joystick.has_ended()) print_note("the joystick has been unplugged; the base stops");
  return 0;
}

}  // namespace doppel::app
