// `doppel teleop keyboard`: the node teleop_twist_keyboard.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "app/verbs/raw_terminal.h"
#include "app/verbs/teleop_arm.h"
#include "app/verbs/teleop_options.h"
#include "doppel/ros/bus/parameter_file.h"

namespace doppel::app {
namespace {

using Steady = std::chrono::steady_clock;

constexpr auto kKeyPeriod = std::chrono::milliseconds(50);
constexpr int kStopsAtRelease = 3;  // messages; one of them could be lost on a network

// The node's parameters, which others may change while the verb runs; keys change the speeds.
class KeyboardNode {
 public:
  KeyboardNode(ros2::Context& context, const TeleopOptions& options)
      : keys(options.keys),
        node(context, "teleop_twist_keyboard", robot_namespace()),
        written_(context.overrides_for(node.on_bus())),
        frame_(options.frame) {}

  // Throws ClientError without a base.
  void open_base(Client& twin, bool remote, const TeleopOptions& options) {
    const VelocityTopic topic =
        open_velocity(twin, node, options, asked_stamped(options, written_, "stamped"));
    stamped_ = topic.stamped;
    if (const Status fine = check_frame(frame_); !fine) throw_usage_error("--frame-id: " + fine.why());
    base.emplace(twin, topic, remote ? &node : nullptr);
  }

  void declare_parameters() {
    Parameters& parameters = node.on_bus().parameters();
    declare<bool>(parameters, &written_, "stamped", stamped_,
                  {.description = "Whether TwistStamped is published instead of Twist", .read_only = true});
    const auto frame_check = [this](const ParameterValue& value) {
      return check_frame(std::get<std::string>(value));
    };
    take_frame(
        declare<std::string>(parameters, &written_, "frame_id", frame_,
                             {.description = "Frame in the header of TwistStamped", .check = frame_check}));
    const ParameterRange positive{0, std::numeric_limits<double>::infinity()};
    keys.set_speed(declare<double>(parameters, &written_, "speed", keys.speed(),
                                   {.description = "Linear speed, m/s", .range = positive}));
    keys.set_turn(declare<double>(parameters, &written_, "turn", keys.turn(),
                                  {.description = "Angular speed, rad/s", .range = positive}));
    node.on_parameter_change([this](const std::string& name, const ParameterValue& value) {
      if (name == "frame_id") take_frame(std::get<std::string>(value));
      if (name == "speed") keys.set_speed(std::get<double>(value));
      if (name == "turn") keys.set_turn(std::get<double>(value));
    });
    report_unused_parameters(written_, node);
  }

  // After a key has changed them.
  void publish_speeds() {
    static_cast<void>(node.set_parameter("speed", keys.speed()));
    static_cast<void>(node.set_parameter("turn", keys.turn()));
  }

  TeleopKeys keys;
  ros2::Node node;
  std::optional<VelocityPublisher> base;

 private:
  [[nodiscard]] Status check_frame(const std::string& frame) const {
    return stamped_ || frame.empty() ? Status() : Status::refused("a frame needs TwistStamped (stamped)");
  }
  void take_frame(const std::string& frame) {
    if (base) base->set_frame(frame);
  }

  ParameterOverrides written_;
  std::string frame_;
  bool stamped_ = false;
};

void report_key(const TeleopKeys& keys, KeyEffect effect, const TeleopArm& arm, KeyTime now) {
  if (effect == KeyEffect::speed)
    print_note(fmt::format("currently: speed {:.3g} turn {:.3g}", keys.speed(), keys.turn()));
  if (effect == KeyEffect::reverse) print_note(keys.direction() > 0 ? "joints: forward" : "joints: backward");
  if (effect != KeyEffect::joint) return;
  const auto index = static_cast<std::size_t>(keys.joint(now)->joint);
  if (index >= arm.joints().size()) print_note(fmt::format("there is no joint {}", index + 1));
}

// Receives messages while keys are awaited: the clock, states of the arm's joints.
void receive_messages(Client& twin, std::optional<VelocityPublisher>& base, TeleopArm& arm) {
  if (base) return base->receive([&](const auto& received) { arm.take(received); });
  Client::Received message;
  twin.sync();
  while (twin.next(message, Steady::now())) arm.take(message);
}

}  // namespace

int teleop_keyboard(Shell& shell, const TeleopOptions& options) {
  Client& twin = shell.twin();
  TeleopArm arm(twin);
  const auto context = open_context(options);
  KeyboardNode keyboard(*context, options);
  try {
    keyboard.open_base(twin, shell.is_remote(), options);
  } catch (const ClientError&) {
    if (arm.joints().empty() || !options.topic.empty()) throw;  // an arm without a base can be moved
    print_note("no base: 1 to 9 move the joints of the arm");
  }
  keyboard.declare_parameters();
  std::optional<VelocityPublisher>& base = keyboard.base;
  TeleopKeys& keys = keyboard.keys;
  print_note(teleop_help());
  print_note(fmt::format("currently: speed {:.3g} turn {:.3g}", keys.speed(), keys.turn()));
  Shell::catch_interrupts();
  RawTerminal terminal(STDIN_FILENO);
  std::optional<StopAtExit> stop_at_exit;
  if (base) stop_at_exit.emplace(*base);
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
      if (effect == KeyEffect::speed) keyboard.publish_speeds();
      if (effect == KeyEffect::motion) due = now;  // a key acts at once
      if (effect == KeyEffect::motion || effect == KeyEffect::joint) stops_left = kStopsAtRelease;
    }
    if (now < due) continue;
    due = now + kKeyPeriod;
    context->spin_some();
    receive_messages(twin, base, arm);
    const auto joint = keys.joint(now);
    if (joint) {
      arm.move(static_cast<std::size_t>(joint->joint), joint->direction * options.joint_speed,
               std::chrono::duration<double>(kKeyPeriod).count());
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

}  // namespace doppel::app
