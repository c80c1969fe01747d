#include "doppel/control/controllers/detail/forward_command_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

Names with_interface(const Names& joints, const std::string& interface) {
  Names out;
  for (const std::string& joint : joints) out.push_back(joint + "/" + interface);
  return out;
}

[[noreturn]] void refuse_empty(const ControllerContext& context, const std::string& parameter,
                               const char* example) {
  throw InputError(
      "control.empty_parameter", place_of(context, parameter),
      fmt::format("controller '{}' has no '{}', so it commands nothing", context.name, parameter),
      fmt::format("write {}: {} below its ros__parameters", parameter, example));
}

Names required_list(ControllerContext& context, const char* parameter, const char* description,
                    const char* example) {
  auto names =
      declare<Names>(context.node->parameters(), context.overrides, parameter, {}, {description, true, {}});
  if (names.empty()) refuse_empty(context, parameter, example);
  return names;
}

std::string required_text(ControllerContext& context, const char* parameter, const char* description,
                          const char* example) {
  auto text = declare<std::string>(context.node->parameters(), context.overrides, parameter, "",
                                   {description, true, {}});
  if (text.empty()) refuse_empty(context, parameter, example);
  return text;
}

}  // namespace

void CommandForwarder::forward(ControllerContext& context, Names listed, Names driven,
                               std::optional<double> on_stop) {
  name_ = context.name;
  log_ = context.log;
  listed_ = std::move(listed);
  driven_ = std::move(driven);
  on_stop_ = on_stop;
  for (const std::string& full_name : driven_) {
    source_.push_back(
        static_cast<std::size_t>(std::find(listed_.begin(), listed_.end(), full_name) - listed_.begin()));
  }
  for (const std::string& full_name : driven_)
    stops_.push_back(full_name.substr(full_name.find_last_of('/') + 1) != kPosition);
  const double timeout = declare<double>(
      context.node->parameters(), context.overrides, "command_timeout", 0.0,
      {"s without a message, after which velocities, accelerations and efforts are zero; 0: never", true,
       [](const ParameterValue& value) {
         const double s = std::get<double>(value);
         return s >= 0 && std::isfinite(s) ? Status{} : Status::refused("it must be at least 0 s");
       }});
  timeout_ = from_seconds(timeout);
  values_.assign(driven_.size(), 0.0);
  context.node->subscribe<std_msgs::msg::Float64MultiArray>(
      "~/commands", [this](const auto& m) { receive(m); }, Qos::system_default_subscription());
}

InterfaceConfiguration CommandForwarder::command_interfaces() const {
  return {InterfaceConfiguration::Kind::individual, driven_};
}

void CommandForwarder::receive(const std_msgs::msg::Float64MultiArray& message) {
  if (!active_) return;
  std::string why;
  if (message.data.size() != listed_.size()) {
    why = fmt::format("a command has {} value{}, but there {} {}: {}", message.data.size(),
                      message.data.size() == 1 ? "" : "s", listed_.size() == 1 ? "is" : "are", listed_.size(),
                      fmt::join(listed_, ", "));
  } else if (!std::all_of(message.data.begin(), message.data.end(),
                          [](double v) { return std::isfinite(v); })) {
    why = "a command contains a value that is not a finite number";
  }
  if (!why.empty()) {
    // A stream of invalid commands is reported once.
    if (!error_logged_) log_->error(name_, why + "; rejected, the last valid command stays in effect");
    error_logged_ = true;
    return;
  }
  error_logged_ = false;
  commanded_ = message_came_ = true;
  for (std::size_t i = 0; i < values_.size(); ++i) values_[i] = message.data[source_[i]];
}

Status CommandForwarder::on_activate() {
  active_ = true;
  error_logged_ = timed_out_ = timeout_logged_ = false;
  commanded_ = message_came_ = std::isfinite(initial_);
  if (commanded_) values_.assign(driven_.size(), initial_);
  return {};
}

Status CommandForwarder::on_deactivate() {
  active_ = commanded_ = false;
  if (on_stop_) {
    for (CommandHandle& handle : command_handles) handle.set(*on_stop_);
  }
  return {};
}

void CommandForwarder::update(Time now, Duration /*period*/) {
  if (!commanded_) return;
  if (message_came_) {
    last_message_ = now;
    message_came_ = timed_out_ = false;
  } else if (timeout_ > Duration{} && !timed_out_ && now - last_message_ > timeout_) {
    timed_out_ = true;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (stops_[i]) values_[i] = 0.0;
    }
  }
  for (std::size_t i = 0; i < command_handles.size(); ++i) command_handles[i].set(values_[i]);
}

void CommandForwarder::housekeeping(Time /*now*/) {
  if (timed_out_ && !timeout_logged_)
    log_->warning(
        name_,
        fmt::format("no command for {:g} s: all commands except positions are set to zero until the next one",
                    to_seconds(timeout_)));
  timeout_logged_ = timed_out_;
}

void ForwardCommandController::on_init(ControllerContext& context) {
  const Names joints = required_list(context, "joints", "the joints it commands", "[a, b]");
  const std::string interface =
      required_text(context, "interface_name", "of each joint: position, ...", "position");
  forward(context, with_interface(joints, interface),
          with_interface(check_joints(context, "joints", joints), interface));
}

void MultiInterfaceForwardCommandController::on_init(ControllerContext& context) {
  const std::string joint = required_text(context, "joint", "the joint it commands", "a");
  const Names interfaces = required_list(context, "interface_names", "of the joint", "[position, velocity]");
  Names listed;
  for (const std::string& interface : interfaces) listed.push_back(joint + "/" + interface);
  forward(context, listed, check_joints(context, "joint", {joint}).empty() ? Names{} : listed);
}

void JointGroupController::on_init(ControllerContext& context) {
  const Names joints = required_list(context, "joints", "the joints it commands", "[a, b]");
  // The groups of ros2_controllers are derived from forward_command_controller, and files may
  // set its parameter.
  declare<std::string>(context.node->parameters(), context.overrides, "interface_name", interface_,
                       {"fixed by the controller's type", true, [this](const ParameterValue& value) {
                          return std::get<std::string>(value) == interface_
                                     ? Status{}
                                     : Status::refused(fmt::format("this type commands '{}'", interface_));
                        }});
  const bool stops = interface_ != kPosition;
  forward(context, with_interface(joints, interface_),
          with_interface(check_joints(context, "joints", joints), interface_),
          stops ? std::optional(0.0) : std::nullopt);
}

void ScalarCommandController::on_init(ControllerContext& context) {
  const Names joints = required_list(context, "joints", "the joints it commands", "[a, b]");
  const std::string interface =
      required_text(context, "interface_name", "of each joint: position, ...", "position");
  start_with(declare<double>(context.node->parameters(), context.overrides, "initial_value",
                             std::numeric_limits<double>::quiet_NaN(),
                             {"written until the first message; NaN: nothing is", true, {}}));
  forward(context, with_interface(joints, interface),
          with_interface(check_joints(context, "joints", joints), interface),
          interface == kPosition ? std::nullopt : std::optional(0.0));
  context.node->subscribe<std_msgs::msg::Float64>(
      "~/command",
      [this](const std_msgs::msg::Float64& m) {
        std_msgs::msg::Float64MultiArray all;
        all.data.assign(listed_count(), m.data);
        receive(all);
      },
      Qos::system_default_subscription());
}

}  // namespace doppel
