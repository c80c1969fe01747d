// A PID controller for each degree of freedom, from ~/reference (control_msgs/msg/MultiDOFCommand), or from
// the controller before it in a chain, and a measured state to one command interface; publishes
// ~/controller_state. Compatible with ros2_controllers' pid_controller.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/core/names.h"
#include "doppel/control/controllers/detail/commanders.h"
#include "doppel/control/controllers/detail/pid.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/distro_differences.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

// The shortest rotation between two angles, in (-pi, pi].
double short_way(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

constexpr const char* kPidParameter = "control.pid_parameter";

class PidController : public Controller {
 public:
  void on_init(ControllerContext& context) override {
    name_ = context.name;
    log_ = context.log;
    declare_names(context);
    for (Dof& dof : dofs_) declare_gains(context, dof);
    listen_to_gains(context);
    declare_topics(context);
  }

  [[nodiscard]] InterfaceConfiguration command_interfaces() const override {
    InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
    for (const Dof& dof : dofs_) wanted.names.push_back(dof.name + "/" + command_interface_);
    return wanted;
  }

  [[nodiscard]] InterfaceConfiguration state_interfaces() const override {
    InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
    for (const Dof& dof : dofs_) {
      for (const std::string& interface : interfaces_) wanted.names.push_back(dof.measured + "/" + interface);
    }
    return wanted;
  }

  [[nodiscard]] std::vector<std::string> reference_interfaces() const override {
    return state_interfaces().names;
  }

  Status on_activate() override {
    active_ = true;
    error_logged_ = chained_ = false;
    for (std::size_t i = 0; i < dofs_.size(); ++i) {
      follow(i, kNaN, 0.0);
      dofs_[i].last_error = kNaN;
      dofs_[i].pid.reset();
    }
    return {};
  }

  Status on_deactivate() override {
    active_ = false;
    // An effort or a velocity that is no longer controlled must not remain.
    if (command_interface_ != kPosition) {
      for (CommandHandle& handle : command_handles) handle.set(0.0);
    }
    return {};
  }

  [[nodiscard]] bool save(SavedSlot& slot) const override {
    auto& [dofs, state, error_logged] = value_in<Saved>(slot);
    dofs.clear();
    for (const Dof& dof : dofs_) dofs.emplace_back(dof.pid.memory(), dof.last_error);
    state = state_;
    error_logged = error_logged_;
    return true;
  }
  void restore(const SavedPart& saved, Time /*now*/) override {
    const Saved* const before = value_of<Saved>(&saved);
    if (before == nullptr || before->dofs.size() != dofs_.size()) return;
    for (std::size_t i = 0; i < dofs_.size(); ++i) {
      dofs_[i].pid.set_memory(before->dofs[i].first);
      dofs_[i].last_error = before->dofs[i].second;
    }
    state_ = before->state;
    error_logged_ = before->error_logged;
  }

  void update(Time now, Duration period) override {
    const double dt = to_seconds(period);
    for (std::size_t i = 0; i < dofs_.size(); ++i) step(i, dt);
    if (!state_topic_.has_listeners()) return;
    state_.header.stamp = to_time_msg(bus_->stamp(now));
    state_topic_.publish(state_, now);
  }

  // The last values of a leader are not continued: the references become the present positions.
  void set_chained_mode(bool chained) override {
    chained_ = chained;
    for (std::size_t i = 0; i < dofs_.size(); ++i)
      follow(i, chained ? kNaN : state_handles[i * interfaces_.size()].get(), 0.0);
  }

 private:
  struct Dof {
    std::string name, measured;  // the commanded one; the one of the measured state
    PidGains gains = {};
    Pid pid = {};
    double feedforward = 0;
    bool wraps = false;     // an angle whose error is the shortest rotation
    double last_error = 0;  // NaN: none yet
  };

  // The state that changes while the controller runs.
  struct Saved {
    std::vector<std::pair<PidMemory, double>> dofs;  // and the last error
    control_msgs::msg::MultiDOFStateStamped state;   // keeps the values of a dof without a reference
    bool error_logged = false;
  };

  void declare_names(ControllerContext& context) {
    constexpr const char *kMeasured = "reference_and_state_dof_names",
                         *kInterfaces = "reference_and_state_interfaces";
    Names names, measured;
    declare_parameters(
        context, {{"dof_names",
                   &names,
                   "joints it commands",
                   read_only(),
                   {kPidParameter, ": '{}' is empty, so it commands nothing", "write {}: [a, b]"}},
                  {kMeasured, &measured, "joints whose states it reads; empty: dof_names", read_only()},
                  {"command_interface",
                   &command_interface_,
                   "of each dof: effort, velocity ...",
                   read_only(),
                   {kPidParameter, ": '{}' is empty", "write {}: effort"}},
                  {kInterfaces, &interfaces_, "a quantity, or a quantity and its derivative", read_only()},
                  {"enable_feedforward", &use_feedforward_, "add gain times reference"}});
    if (measured.empty()) measured = names;
    if (measured.size() != names.size()) {
      refuse_parameter(context, kPidParameter, kMeasured,
                       fmt::format("has {} names, but dof_names has {}", measured.size(), names.size()),
                       "give one for each, or none");
    }
    if (interfaces_.size() != 1 && interfaces_.size() != 2) {
      refuse_parameter(context, kPidParameter, kInterfaces, fmt::format("has {} entries", interfaces_.size()),
                       "give one, or a quantity and its derivative: [position, velocity]");
    }
    const Names driven = check_joints(context, "dof_names", names);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (std::find(driven.begin(), driven.end(), names[i]) == driven.end()) continue;  // a mimic
      dofs_.push_back({.name = names[i], .measured = measured[i]});
    }
  }

  static ControllerParameters gains_of(Dof& dof) {
    const std::string prefix = fmt::format("gains.{}.", dof.name);
    ControllerParameters list = gain_parameters(dof.gains, prefix);
    list.emplace_back(prefix + "feedforward_gain", &dof.feedforward, "times the reference");
    list.emplace_back(prefix + "antiwindup_strategy", &dof.gains.antiwindup_strategy,
                      "legacy, none, conditional_integration or back_calculation");
    list.emplace_back(prefix + "angle_wraparound", &dof.wraps, "wrap the error as an angle");
    return list;
  }

  void declare_gains(ControllerContext& context, Dof& dof) {
    declare_parameters(context, gains_of(dof));
    if (const Status taken = take_gains(context.node->parameters(), dof); !taken) {
      SourceLocation place;
      for (const ParameterOverride& o : context.overrides->all()) {
        if (!place.known() && o.name.starts_with(fmt::format("gains.{}.", dof.name))) place = o.source;
      }
      throw InputError("control.pid_gains", place,
                       fmt::format("controller '{}', '{}': {}", name_, dof.name, taken.why()));
    }
  }

  Status take_gains(const Parameters& parameters, Dof& dof) {
    Dof changed = dof;
    read_parameters(parameters, gains_of(changed));
    if (Status fine = check_gains(changed.gains); !fine) return fine;
    changed.pid.set_gains(changed.gains);
    dof = std::move(changed);
    return {};
  }

  // Gains can be changed at run time; an inconsistent set is rejected and the former one remains.
  void listen_to_gains(ControllerContext& context) {
    Parameters& parameters = context.node->parameters();
    parameters.on_change([this, &parameters](const std::string& name, const ParameterValue& value) {
      if (name == "enable_feedforward") use_feedforward_ = std::get<bool>(value);
      for (Dof& dof : dofs_) {
        if (!name.starts_with(fmt::format("gains.{}.", dof.name))) continue;
        if (const Status taken = take_gains(parameters, dof); !taken) {
          log_->error(name_,
                      fmt::format("'{}': {}; the previous gains stay in effect", dof.name, taken.why()));
        }
      }
    });
  }

  void declare_topics(ControllerContext& context) {
    Node& node = *context.node;
    bus_ = &node.bus();
    state_topic_ = node.advertise<control_msgs::msg::MultiDOFStateStamped>("~/controller_state",
                                                                           Qos::system_default_publisher());
    state_.dof_states.resize(dofs_.size());
    for (std::size_t i = 0; i < dofs_.size(); ++i) state_.dof_states[i].name = dofs_[i].name;
    node.subscribe<control_msgs::msg::MultiDOFCommand>(
        "~/reference", [this](const auto& m) { receive(m); }, Qos::system_default_subscription());
    // The service went with the parameter.
    if (missing_parameter(context.type, "enable_feedforward") != nullptr) return;
    node.serve<std_srvs::srv::SetBool>(
        "~/set_feedforward_control", [this](const auto& request, auto respond) {
          use_feedforward_ = request.data;
          respond({true, request.data ? "feed-forward is on" : "feed-forward is off"});
        });
  }

  [[nodiscard]] std::string fault_of(const control_msgs::msg::MultiDOFCommand& message) const {
    Names names;
    for (const Dof& dof : dofs_) names.push_back(dof.measured);
    const std::size_t expected = message.dof_names.empty() ? names.size() : message.dof_names.size();
    if (message.values.size() != expected) {
      return fmt::format("a reference has {} values for {} names", message.values.size(), expected);
    }
    if (!message.values_dot.empty() && message.values_dot.size() != expected) {
      return fmt::format("a reference has {} derivatives for {} names", message.values_dot.size(), expected);
    }
    for (const std::string& name : message.dof_names) {
      if (std::find(names.begin(), names.end(), name) == names.end()) {
        return fmt::format("a reference lists '{}', which this controller does not command{}", name,
                           did_you_mean(name, names));
      }
    }
    // NaN keeps the present reference of a degree of freedom; infinity is ignored, as in ros2_controllers.
    const auto infinite = [](double value) { return std::isinf(value); };
    const bool bad = std::any_of(message.values.begin(), message.values.end(), infinite) ||
                     std::any_of(message.values_dot.begin(), message.values_dot.end(), infinite);
    return bad ? "a reference contains an infinite value" : "";
  }

  void receive(const control_msgs::msg::MultiDOFCommand& message) {
    if (!active_ || chained_) return;
    if (const std::string why = fault_of(message); !why.empty()) {
      if (!error_logged_) log_->error(name_, why + "; rejected, the last valid one stays in effect");
      error_logged_ = true;
      return;
    }
    error_logged_ = false;
    for (std::size_t i = 0; i < message.values.size(); ++i) {
      const auto dof = message.dof_names.empty()
                           ? dofs_.begin() + static_cast<std::ptrdiff_t>(i)
                           : std::find_if(dofs_.begin(), dofs_.end(),
                                          [&](const Dof& d) { return d.measured == message.dof_names[i]; });
      if (std::isnan(message.values[i])) continue;
      const bool has_dot = !message.values_dot.empty() && !std::isnan(message.values_dot[i]);
      follow(static_cast<std::size_t>(dof - dofs_.begin()), message.values[i],
             has_dot ? message.values_dot[i] : 0.0);
    }
  }

  // The references are stored in the same interfaces to which a leader writes.
  void follow(std::size_t index, double reference, double reference_dot) {
    const std::size_t first = index * interfaces_.size();
    reference_handles[first].set(reference);
    if (interfaces_.size() == 2) reference_handles[first + 1].set(reference_dot);
  }

  void step(std::size_t index, double dt) {
    Dof& dof = dofs_[index];
    const std::size_t first = index * interfaces_.size();
    const double measured = state_handles[first].get();
    auto& state = state_.dof_states[index];
    const double reference = reference_handles[first].get();
    state.reference = reference;
    state.feedback = measured;
    state.time_step = dt;
    if (!std::isfinite(reference) || !std::isfinite(measured)) return;
    const double error = dof.wraps ? short_way(reference - measured) : reference - measured;
    double error_dot = 0;
    if (interfaces_.size() == 2) {
      state.feedback_dot = state_handles[first + 1].get();
      const double reference_dot = reference_handles[first + 1].get();
      error_dot = (std::isfinite(reference_dot) ? reference_dot : 0.0) - state.feedback_dot;
    } else if (std::isfinite(dof.last_error)) {
      const double change = error - dof.last_error;
      error_dot = (dof.wraps ? short_way(change) : change) / dt;
    }
    dof.last_error = error;
    const double feedforward = use_feedforward_ ? dof.feedforward * reference : 0.0;
    state.error = error;
    state.error_dot = error_dot;
    state.output = feedforward + dof.pid.compute(error, error_dot, dt);
    command_handles[index].set(state.output);
  }

  std::string name_, command_interface_;
  const Log* log_ = nullptr;
  const Bus* bus_ = nullptr;
  std::vector<std::string> interfaces_;  // one or two: of reference and measured state
  std::vector<Dof> dofs_;
  bool use_feedforward_ = false, active_ = false, error_logged_ = false;
  bool chained_ = false;  // another controller writes the references
  Publisher<control_msgs::msg::MultiDOFStateStamped> state_topic_;
  control_msgs::msg::MultiDOFStateStamped state_;
};

}  // namespace

std::unique_ptr<Controller> make_pid_controller() {
  return std::make_unique<PidController>();
}

}  // namespace doppel
