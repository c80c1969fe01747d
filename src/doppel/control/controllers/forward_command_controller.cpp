// Controllers that forward ~/commands (std_msgs/msg/Float64MultiArray) to command interfaces, one number
// each. They write nothing until the first message; with the parameter command_timeout (s; 0: never) they
// write zero to all interfaces but positions after that time without a message. Compatible with
// ros2_controllers' forward_command_controller and its groups.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/control/controllers/detail/commanders.h"
#include "doppel/control/controllers/detail/controller_parameters.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

Names with_interface(const Names& joints, const std::string& interface) {
  Names out;
  for (const std::string& joint : joints) out.push_back(joint + "/" + interface);
  return out;
}

ControllerParameter required_names(const char* name, Names& names, const char* description,
                                   const char* example) {
  return {name, &names, description, read_only(), required_value(example, ", so it commands nothing")};
}

ControllerParameter required_name(const char* name, std::string& text, const char* description,
                                  const char* example) {
  return {name, &text, description, read_only(), required_value(example, ", so it commands nothing")};
}

ControllerParameter joints_parameter(Names& joints) {
  return required_names("joints", joints, "the joints it commands", "[a, b]");
}

ControllerParameter interface_parameter(std::string& interface) {
  return required_name("interface_name", interface, "of each joint: position, ...", "position");
}

// The common base. A message has one value for each interface that the YAML lists; those of mimic joints,
// which cannot be commanded, are ignored.
class CommandForwarder : public Controller {
 public:
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override {
    return {InterfaceConfiguration::Kind::individual, driven_};
  }

  [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }

  Status on_activate() override {
    active_ = true;
    run_.error_logged = run_.timed_out = run_.timeout_logged = false;
    run_.commanded = run_.message_came = std::isfinite(initial_);
    if (run_.commanded) run_.values.assign(driven_.size(), initial_);
    return {};
  }

  Status on_deactivate() override {
    active_ = run_.commanded = false;
    if (on_stop_) {
      for (CommandHandle& handle : command_handles) handle.set(*on_stop_);
    }
    return {};
  }

  void update(Time now, Duration /*period*/) override {
    if (!run_.commanded) return;
    if (run_.message_came) {
      run_.last_message = now;
      run_.message_came = run_.timed_out = false;
    } else if (timeout_ > Duration{} && !run_.timed_out && now - run_.last_message > timeout_) {
      run_.timed_out = true;
      for (std::size_t i = 0; i < run_.values.size(); ++i) {
        if (stops_[i]) run_.values[i] = 0.0;
      }
    }
    for (std::size_t i = 0; i < command_handles.size(); ++i) command_handles[i].set(run_.values[i]);
  }

  [[nodiscard]] bool save(SavedSlot& slot) const override { return save_run(run_, slot); }
  void restore(const SavedPart& saved, Time /*now*/) override { restore_run(saved, run_); }

  void housekeeping(Time /*now*/) override {
    if (run_.timed_out && !run_.timeout_logged)
      log_->warning(
          name_,
          fmt::format(
              "no command for {:g} s: all commands except positions are set to zero until the next one",
              to_seconds(timeout_)));
    run_.timeout_logged = run_.timed_out;
  }

 protected:
  // `listed`: the interfaces of a message, in order; `driven`: those that are claimed. on_stop:
  // written at deactivation.
  void forward(ControllerContext& context, Names listed, Names driven,
               std::optional<double> on_stop = std::nullopt) {
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
    double timeout = 0;
    const ParameterOptions seconds{.check = [](const ParameterValue& value) {
      const double s = std::get<double>(value);
      return s >= 0 && std::isfinite(s) ? Status{} : Status::refused("it must be at least 0 s");
    }};
    declare_parameters(
        context,
        {{"command_timeout", &timeout,
          "s without a message, after which velocities, accelerations and efforts are zero; 0: never",
          read_only(seconds)}});
    timeout_ = from_seconds(timeout);
    run_.values.assign(driven_.size(), 0.0);
    context.node->subscribe<std_msgs::msg::Float64MultiArray>(
        "~/commands", [this](const auto& m) { receive(m); }, Qos::system_default_subscription());
  }

  void receive(const std_msgs::msg::Float64MultiArray& message) {
    if (!active_) return;
    std::string why;
    if (message.data.size() != listed_.size()) {
      why = fmt::format("a command has {} value{}, but there {} {}: {}", message.data.size(),
                        message.data.size() == 1 ? "" : "s", listed_.size() == 1 ? "is" : "are",
                        listed_.size(), fmt::join(listed_, ", "));
    } else if (!std::all_of(message.data.begin(), message.data.end(),
                            [](double v) { return std::isfinite(v); })) {
      why = "a command contains a value that is not a finite number";
    }
    if (!why.empty()) {
      // A stream of invalid commands is reported once.
      if (!run_.error_logged) log_->error(name_, why + "; rejected, the last valid command stays in effect");
      run_.error_logged = true;
      return;
    }
    run_.error_logged = false;
    run_.commanded = run_.message_came = true;
    for (std::size_t i = 0; i < run_.values.size(); ++i) run_.values[i] = message.data[source_[i]];
  }

  [[nodiscard]] std::size_t listed_count() const { return listed_.size(); }
  // Written from the activation until the first message; NaN: nothing is.
  void start_with(double value) { initial_ = value; }

 private:
  std::string name_;
  const Log* log_ = nullptr;
  std::vector<std::string> listed_, driven_;
  std::vector<std::size_t> source_;  // of each driven interface: its index in a message
  std::optional<double> on_stop_;
  double initial_ = kNaN;
  std::vector<bool> stops_;  // of each driven interface: zero is no motion
  Duration timeout_{};       // zero: commands hold forever
  bool active_ = false;
  // The state that changes while the controller runs.
  struct Run {
    std::vector<double> values;  // of the last message, one for each driven interface
    Time last_message{};
    bool message_came = false, timed_out = false, timeout_logged = false, commanded = false,
         error_logged = false;
  } run_;
};

// Parameters: joints, interface_name.
class ForwardCommandController : public CommandForwarder {
 public:
  void on_init(ControllerContext& context) override {
    Names joints;
    std::string interface;
    declare_parameters(context, {joints_parameter(joints), interface_parameter(interface)});
    forward(context, with_interface(joints, interface),
            with_interface(check_joints(context, "joints", joints), interface));
  }
};

// Parameters: joint, interface_names.
class MultiInterfaceForwardCommandController : public CommandForwarder {
 public:
  void on_init(ControllerContext& context) override {
    std::string joint;
    Names interfaces, listed;
    declare_parameters(
        context, {required_name("joint", joint, "the joint it commands", "a"),
                  required_names("interface_names", interfaces, "of the joint", "[position, velocity]")});
    for (const std::string& interface : interfaces) listed.push_back(joint + "/" + interface);
    forward(context, listed, check_joints(context, "joint", {joint}).empty() ? Names{} : listed);
  }
};

// Parameter: joints. Velocity and effort go to zero when it is deactivated.
class JointGroupController : public CommandForwarder {
 public:
  explicit JointGroupController(const char* interface) : interface_(interface) {}
  void on_init(ControllerContext& context) override {
    Names joints;
    // The groups of ros2_controllers are derived from forward_command_controller, and files may
    // set its parameter.
    const ParameterOptions same{.check = [this](const ParameterValue& value) {
      return std::get<std::string>(value) == interface_
                 ? Status{}
                 : Status::refused(fmt::format("this type commands '{}'", interface_));
    }};
    declare_parameters(context,
                       {joints_parameter(joints),
                        {"interface_name", &interface_, "fixed by the controller's type", read_only(same)}});
    const bool stops = interface_ != kPosition;
    forward(context, with_interface(joints, interface_),
            with_interface(check_joints(context, "joints", joints), interface_),
            stops ? std::optional(0.0) : std::nullopt);
  }

 private:
  std::string interface_;
};

// One number for all its joints, also as ~/command (std_msgs/msg/Float64), as the joint plugins of gz-sim
// read it. Parameters: joints, interface_name, initial_value (NaN: none). Velocity and effort go to zero when
// it is deactivated.
class ScalarCommandController : public CommandForwarder {
 public:
  void on_init(ControllerContext& context) override {
    Names joints;
    std::string interface;
    double initial = kNaN;
    declare_parameters(context, {joints_parameter(joints),
                                 interface_parameter(interface),
                                 {"initial_value", &initial,
                                  "written until the first message; NaN: nothing is", read_only()}});
    start_with(initial);
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
};

}  // namespace

std::unique_ptr<Controller> make_forward_command_controller() {
  return std::make_unique<ForwardCommandController>();
}

std::unique_ptr<Controller> make_multi_interface_forward_command_controller() {
  return std::make_unique<MultiInterfaceForwardCommandController>();
}

std::unique_ptr<Controller> make_joint_group_controller(const char* interface) {
  return std::make_unique<JointGroupController>(interface);
}

std::unique_ptr<Controller> make_scalar_command_controller() {
  return std::make_unique<ScalarCommandController>();
}

}  // namespace doppel
