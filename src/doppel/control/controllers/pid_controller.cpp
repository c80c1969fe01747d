#include "doppel/control/controllers/detail/pid_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

// The shortest rotation between two angles, in (-pi, pi].
double short_way(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

void require(bool fine, const ControllerContext& context, const char* parameter, const std::string& why,
             const std::string& fix) {
  if (fine) return;
  throw InputError("control.pid_parameter", place_of(context, parameter),
                   fmt::format("controller '{}': '{}' {}", context.name, parameter, why), fix);
}

}  // namespace

void PidController::on_init(ControllerContext& context) {
  name_ = context.name;
  log_ = context.log;
  declare_names(context);
  for (Dof& dof : dofs_) declare_gains(context, dof);
  listen_to_gains(context);
  declare_topics(context);
}

void PidController::declare_names(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  const auto names = declare<Names>(parameters, written, "dof_names", {}, {"joints it commands", true, {}});
  require(!names.empty(), context, "dof_names", "is empty, so it commands nothing",
          "write dof_names: [a, b]");
  auto measured = declare<Names>(parameters, written, "reference_and_state_dof_names", {},
                                 {"joints whose states it reads; empty: dof_names", true, {}});
  require(measured.empty() || measured.size() == names.size(), context, "reference_and_state_dof_names",
          fmt::format("has {} names, but dof_names has {}", measured.size(), names.size()),
          "give one for each, or none");
  if (measured.empty()) measured = names;
  command_interface_ = declare<std::string>(parameters, written, "command_interface", "",
                                            {"of each dof: effort, velocity ...", true, {}});
  require(!command_interface_.empty(), context, "command_interface", "is empty",
          "write command_interface: effort");
  interfaces_ = declare<Names>(parameters, written, "reference_and_state_interfaces", {},
                               {"a quantity, or a quantity and its derivative", true, {}});
  require(interfaces_.size() == 1 || interfaces_.size() == 2, context, "reference_and_state_interfaces",
          fmt::format("has {} entries", interfaces_.size()),
          "give one, or a quantity and its derivative: [position, velocity]");
  const Names driven = check_joints(context, "dof_names", names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(driven.begin(), driven.end(), names[i]) == driven.end()) continue;  // a mimic
    Dof dof;
    dof.name = names[i];
    dof.measured = measured[i];
    dofs_.push_back(std::move(dof));
  }
  use_feedforward_ = declare<bool>(parameters, written, "enable_feedforward", false,
                                   {"add gain times reference", false, {}});
}

void PidController::declare_gains(ControllerContext& context, Dof& dof) {
  Parameters& parameters = context.node->parameters();
  const std::string prefix = fmt::format("gains.{}.", dof.name);
  const auto number = [&](const char* gain, double initial, const char* description) {
    declare<double>(parameters, context.overrides, prefix + gain, initial, {description, false, {}});
  };
  number("p", 0.0, "proportional");
  number("i", 0.0, "integral, 1/s");
  number("d", 0.0, "derivative, s");
  number("u_clamp_max", kInfinity, "of the command");
  number("u_clamp_min", -kInfinity, "of the command");
  number("i_clamp_max", kInfinity, "of the integral term");
  number("i_clamp_min", -kInfinity, "of the integral term");
  number("tracking_time_constant", 0.0, "s, of back_calculation; 0: from the gains");
  number("error_deadband", 0.0, "error below which the integral is not updated");
  number("feedforward_gain", 0.0, "times the reference");
  declare<std::string>(parameters, context.overrides, prefix + "antiwindup_strategy",
                       PidGains{}.antiwindup_strategy,
                       {"legacy, none, conditional_integration or back_calculation", false, {}});
  declare<bool>(parameters, context.overrides, prefix + "angle_wraparound", false,
                {"wrap the error as an angle", false, {}});
  if (const Status taken = take_gains(parameters, dof); !taken) {
    SourceLocation place;
    for (const ParameterOverride& o : context.overrides->all()) {
      if (!place.known() && o.name.starts_with(prefix)) place = o.source;
    }
    throw InputError("control.pid_gains", place,
                     fmt::format("controller '{}', '{}': {}", name_, dof.name, taken.why()));
  }
}

Status PidController::take_gains(const Parameters& parameters, Dof& dof) {
  const auto value = [&](const char* gain) {
    return parameters.find(fmt::format("gains.{}.{}", dof.name, gain))->value;
  };
  const auto number = [&](const char* gain) { return std::get<double>(value(gain)); };
  PidGains gains;
  gains.p = number("p");
  gains.i = number("i");
  gains.d = number("d");
  gains.u_clamp_max = number("u_clamp_max");
  gains.u_clamp_min = number("u_clamp_min");
  gains.i_clamp_max = number("i_clamp_max");
  gains.i_clamp_min = number("i_clamp_min");
  gains.tracking_time_constant = number("tracking_time_constant");
  gains.error_deadband = number("error_deadband");
  gains.antiwindup_strategy = std::get<std::string>(value("antiwindup_strategy"));
  if (Status fine = check_gains(gains); !fine) return fine;
  dof.pid.set_gains(gains);
  dof.feedforward = number("feedforward_gain");
  dof.wraps = std::get<bool>(value("angle_wraparound"));
  return {};
}

// Gains can be changed at run time; an inconsistent set is rejected and the former one remains.
void PidController::listen_to_gains(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  parameters.on_change([this, &parameters](const std::string& name, const ParameterValue& value) {
    if (name == "enable_feedforward") use_feedforward_ = std::get<bool>(value);
    for (Dof& dof : dofs_) {
      if (!name.starts_with(fmt::format("gains.{}.", dof.name))) continue;
      if (const Status taken = take_gains(parameters, dof); !taken) {
        log_->error(name_, fmt::format("'{}': {}; the previous gains stay in effect", dof.name, taken.why()));
      }
    }
  });
}

void PidController::declare_topics(ControllerContext& context) {
  Node& node = *context.node;
  bus_ = &node.bus();
  state_topic_ = node.advertise<control_msgs::msg::MultiDOFStateStamped>("~/controller_state",
                                                                         Qos::system_default_publisher());
  state_.dof_states.resize(dofs_.size());
  for (std::size_t i = 0; i < dofs_.size(); ++i) state_.dof_states[i].name = dofs_[i].name;
  node.subscribe<control_msgs::msg::MultiDOFCommand>(
      "~/reference", [this](const auto& m) { receive(m); }, Qos::system_default_subscription());
  node.serve<std_srvs::srv::SetBool>("~/set_feedforward_control", [this](const auto& request, auto respond) {
    use_feedforward_ = request.data;
    respond({true, request.data ? "feed-forward is on" : "feed-forward is off"});
  });
}

InterfaceConfiguration PidController::command_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const Dof& dof : dofs_) wanted.names.push_back(dof.name + "/" + command_interface_);
  return wanted;
}

InterfaceConfiguration PidController::state_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const Dof& dof : dofs_) {
    for (const std::string& interface : interfaces_) wanted.names.push_back(dof.measured + "/" + interface);
  }
  return wanted;
}

std::string PidController::fault_of(const control_msgs::msg::MultiDOFCommand& message) const {
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
  // As in ros2_controllers NaN keeps the present reference of a degree of freedom; infinity is ignored.
  const auto infinite = [](double value) { return std::isinf(value); };
  const bool bad = std::any_of(message.values.begin(), message.values.end(), infinite) ||
                   std::any_of(message.values_dot.begin(), message.values_dot.end(), infinite);
  return bad ? "a reference contains an infinite value" : "";
}

std::vector<std::string> PidController::reference_interfaces() const {
  return state_interfaces().names;
}

// The last values of a leader are not continued: the references become the present positions.
void PidController::set_chained_mode(bool chained) {
  chained_ = chained;
  for (std::size_t i = 0; i < dofs_.size(); ++i)
    follow(i, chained ? kNaN : state_handles[i * interfaces_.size()].get(), 0.0);
}

// The references are stored in the same interfaces to which a leader writes.
void PidController::follow(std::size_t index, double reference, double reference_dot) {
  const std::size_t first = index * interfaces_.size();
  reference_handles[first].set(reference);
  if (interfaces_.size() == 2) reference_handles[first + 1].set(reference_dot);
}

void PidController::receive(const control_msgs::msg::MultiDOFCommand& message) {
  if (!active_ || chained_) return;
  if (const std::string why = fault_of(message); !why.empty()) {
    if (!error_logged_) log_->error(name_, why + "; rejected, the last valid one stays in effect");
    error_logged_ = true;
    return;
  }
  error_logged_ = false;
  for (std::size_t i = 0; i < message.values.size(); ++i) {
    const auto dof = message.dof_names.empty() ? dofs_.begin() + static_cast<std::ptrdiff_t>(i)
                                               : std::find_if(dofs_.begin(), dofs_.end(), [&](const Dof& d) {
                                                   return d.measured == message.dof_names[i];
                                                 });
    if (std::isnan(message.values[i])) continue;
    const bool has_dot = !message.values_dot.empty() && !std::isnan(message.values_dot[i]);
    follow(static_cast<std::size_t>(dof - dofs_.begin()), message.values[i],
           has_dot ? message.values_dot[i] : 0.0);
  }
}

Status PidController::on_activate() {
  active_ = true;
  error_logged_ = chained_ = false;
  for (std::size_t i = 0; i < dofs_.size(); ++i) {
    follow(i, kNaN, 0.0);
    dofs_[i].last_error = kNaN;
    dofs_[i].pid.reset();
  }
  return {};
}

Status PidController::on_deactivate() {
  active_ = false;
  // An effort or a velocity that is no longer controlled must not remain.
  if (command_interface_ != kPosition) {
    for (CommandHandle& handle : command_handles) handle.set(0.0);
  }
  return {};
}

void PidController::step(std::size_t index, double dt) {
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

void PidController::update(Time now, Duration period) {
  const double dt = to_seconds(period);
  for (std::size_t i = 0; i < dofs_.size(); ++i) step(i, dt);
  if (!state_topic_.has_listeners()) return;
  state_.header.stamp = to_time_msg(bus_->stamp(now));
  state_topic_.publish(state_, now);
}

}  // namespace doppel
