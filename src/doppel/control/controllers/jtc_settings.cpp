#include "doppel/control/controllers/detail/jtc_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/control/controllers/detail/name_list.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel::jtc {
namespace {

using Names = std::vector<std::string>;

const Names kKindNames = {kPosition, kVelocity, kAcceleration, kEffort};

const std::vector<Names> kCommandCombinations = {
    {kPosition}, {kPosition, kVelocity}, {kPosition, kVelocity, kAcceleration}, {kVelocity},
    {kEffort},   {kPosition, kEffort}};
const std::vector<Names> kStateCombinations = {
    {kPosition}, {kPosition, kVelocity}, {kPosition, kVelocity, kAcceleration}};

class Declarer {
 public:
  explicit Declarer(ControllerContext& context) : context_(context) {}

  template <class T>
  T fixed(const std::string& name, T initial, const char* description, ParameterOptions options = {}) {
    options.description = description;
    options.read_only = true;
    return declare<T>(context_.node->parameters(), context_.overrides, name, std::move(initial),
                      std::move(options));
  }
  template <class T>
  void changeable(const std::string& name, T initial, const char* description,
                  ParameterOptions options = {}) {
    options.description = description;
    declare<T>(context_.node->parameters(), context_.overrides, name, std::move(initial), std::move(options));
  }

 private:
  ControllerContext& context_;
};

ParameterOptions at_least(double least) {
  return {.range = ParameterRange{least, kInfinity}};
}

ParameterOptions one_of(Names choices) {
  return {.check = [choices = std::move(choices)](const ParameterValue& value) {
    const auto& text = std::get<std::string>(value);
    if (contains(choices, text)) return Status{};
    return Status::refused(fmt::format("unknown '{}'{}", text, did_you_mean(text, choices)));
  }};
}

[[noreturn]] void refuse(const ControllerContext& context, const std::string& parameter, std::size_t element,
                         std::string message, std::string fix) {
  throw InputError("control.jtc_parameter", place_of(context, parameter, element),
                   fmt::format("controller '{}': {}", context.name, message), std::move(fix));
}

void refuse_repeated(const ControllerContext& context, const std::string& parameter, const Names& names) {
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::find(names.begin(), name, *name) == name) continue;
    refuse(context, parameter, static_cast<std::size_t>(name - names.begin()),
           fmt::format("'{}' lists '{}' twice", parameter, *name), "remove one of them");
  }
}

// Rejects empty, unknown or repeated interfaces and combinations that ros2_controllers rejects.
std::array<bool, kKinds> check_interfaces(const ControllerContext& context, const std::string& parameter,
                                          const Names& names, const Names& known,
                                          const std::vector<Names>& combinations) {
  std::string allowed;
  for (const Names& one : combinations) {
    allowed += fmt::format("{}[{}]", allowed.empty() ? "" : ", ", fmt::join(one, ", "));
  }
  if (names.empty()) {
    refuse(context, parameter, 0, fmt::format("'{}' is empty, so nothing can be moved", parameter),
           "write one of " + allowed);
  }
  std::array<bool, kKinds> has{};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!contains(known, names[i])) {
      refuse(context, parameter, i,
             fmt::format("unknown interface '{}'{}", names[i], did_you_mean(names[i], known)),
             "use " + allowed);
    }
    has[static_cast<std::size_t>(std::find(kKindNames.begin(), kKindNames.end(), names[i]) -
                                 kKindNames.begin())] = true;
  }
  refuse_repeated(context, parameter, names);
  const bool usual = std::any_of(combinations.begin(), combinations.end(), [&](const Names& one) {
    return one.size() == names.size() && std::is_permutation(one.begin(), one.end(), names.begin());
  });
  if (!usual) {
    refuse(context, parameter, 0,
           fmt::format("the combination [{}] of '{}' cannot follow a trajectory", fmt::join(names, ", "),
                       parameter),
           "use one of " + allowed);
  }
  return has;
}

void declare_joints(Declarer& declarer, const ControllerContext& context, Settings& settings) {
  const auto listed = declarer.fixed<Names>("joints", {}, "joints of the trajectories");
  auto driven =
      declarer.fixed<Names>("command_joints", {}, "joints of the command interfaces; empty: as joints");
  if (listed.empty())
    refuse(context, "joints", 0, "'joints' is empty, so nothing can be moved", "list the joints");
  refuse_repeated(context, "command_joints", driven);
  const JointUse use = driven.empty() ? JointUse::commanded : JointUse::observed;
  settings.joints = check_joints(context, "joints", listed, use);
  for (const std::string& joint : listed) {
    if (!contains(settings.joints, joint)) settings.ignored.push_back(joint);
  }
  if (settings.joints.empty()) {
    refuse(context, "joints", 0, "none of its joints can be driven", "list joints that have an actuator");
  }
  const bool all_known = std::all_of(
      driven.begin(), driven.end(), [&](const std::string& name) { return contains(settings.joints, name); });
  if (all_known) driven = check_joints(context, "command_joints", driven);
  settings.command_joints = driven.empty() ? settings.joints : driven;
}

void declare_gains(Declarer& declarer, const std::string& joint) {
  const std::string prefix = "gains." + joint + ".";
  const auto number = [&](const char* name, double initial, const char* description,
                          ParameterOptions options = {}) {
    declarer.changeable<double>(prefix + name, initial, description, std::move(options));
  };
  number("p", 0.0, "proportional");
  number("i", 0.0, "integral, 1/s");
  number("d", 0.0, "derivative, s");
  number("i_clamp", kInfinity, "deprecated: i_clamp_max and minus i_clamp_min", at_least(0));
  number("i_clamp_max", kInfinity, "of the integral term");
  number("i_clamp_min", -kInfinity, "of the integral term");
  number("ff_velocity_scale", 0.0, "times the velocity of the trajectory");
  number("u_clamp_max", kInfinity, "of the command");
  number("u_clamp_min", -kInfinity, "of the command");
  number("tracking_time_constant", 0.0, "s, of back_calculation; 0: from the gains", at_least(0));
  number("error_deadband", 0.0, "error below which the integral is not updated", at_least(0));
  declarer.changeable<std::string>(prefix + "antiwindup_strategy", "legacy", "anti-windup strategy",
                                   one_of({"legacy", "back_calculation", "conditional_integration", "none"}));
}

void declare_constraints(Declarer& declarer, Settings& settings) {
  declarer.changeable<double>("constraints.stopped_velocity_tolerance", 0.01, "of every joint at the goal");
  declarer.changeable<double>("constraints.goal_time", 0.0, "s after the last point; 0: unlimited",
                              at_least(0));
  settings.decelerate_on_cancel = declarer.fixed<bool>("constraints.decelerate_on_cancel", false,
                                                       "brake at max_deceleration_on_cancel before holding");
  const auto one = [&](const std::string& joint) {
    const std::string prefix = "constraints." + joint + ".";
    declarer.changeable<double>(prefix + "trajectory", 0.0, "tolerance along the path; 0: not checked");
    declarer.changeable<double>(prefix + "goal", 0.0, "tolerance at the goal; 0: not checked");
    return declarer.fixed<double>(prefix + "max_deceleration_on_cancel", 0.0, "per second squared",
                                  at_least(0));
  };
  for (const std::string& joint : settings.joints) settings.max_deceleration.push_back(one(joint));
  for (const std::string& joint : settings.ignored) one(joint);
}

const ParameterValue& value_of(const Parameters& parameters, const std::string& name) {
  return parameters.find(name)->value;
}

template <class T>
T get(const Parameters& parameters, const std::string& name) {
  return std::get<T>(value_of(parameters, name));
}

PidGains gains_of(const Parameters& parameters, const std::string& joint) {
  const auto number = [&](const char* name) {
    return get<double>(parameters, "gains." + joint + "." + name);
  };
  PidGains gains;
  gains.p = number("p");
  gains.i = number("i");
  gains.d = number("d");
  gains.i_clamp_max = std::min(number("i_clamp_max"), number("i_clamp"));
  gains.i_clamp_min = std::max(number("i_clamp_min"), -number("i_clamp"));
  gains.u_clamp_max = number("u_clamp_max");
  gains.u_clamp_min = number("u_clamp_min");
  gains.antiwindup_strategy = get<std::string>(parameters, "gains." + joint + ".antiwindup_strategy");
  gains.tracking_time_constant = number("tracking_time_constant");
  gains.error_deadband = number("error_deadband");
  return gains;
}

}  // namespace

Settings declare_settings(ControllerContext& context) {
  Declarer declarer(context);
  Settings settings;
  settings.command_interfaces =
      declarer.fixed<Names>("command_interfaces", {}, "commanded interfaces, per joint");
  settings.state_interfaces = declarer.fixed<Names>("state_interfaces", {}, "measured interfaces, per joint");
  declare_joints(declarer, context, settings);
  settings.commanded = check_interfaces(context, "command_interfaces", settings.command_interfaces,
                                        kKindNames, kCommandCombinations);
  settings.measured = check_interfaces(context, "state_interfaces", settings.state_interfaces,
                                       {kPosition, kVelocity, kAcceleration}, kStateCombinations);
  settings.initial_scaling =
      declarer.fixed<double>("speed_scaling.initial_scaling_factor", 1.0, "of trajectory time", at_least(0));
  settings.scaling_state = declarer.fixed<std::string>(
      "speed_scaling.state_interface", "", "full name of the interface that reports the scaling factor");
  settings.scaling_command = declarer.fixed<std::string>(
      "speed_scaling.command_interface", "", "full name of the interface that receives the scaling factor");
  declarer.changeable<bool>("allow_partial_joints_goal", false, "trajectories may omit joints");
  const bool open_loop =
      declarer.fixed<bool>("open_loop_control", false, "deprecated: interpolate_from_desired_state");
  settings.interpolate_from_desired =
      declarer.fixed<bool>("interpolate_from_desired_state", false, "start from the last command") ||
      open_loop;
  declarer.changeable<bool>("allow_integration_in_goal_trajectories", false, "points may omit positions");
  settings.seed_from_commands =
      declarer.fixed<bool>("set_last_command_interface_value_as_state_on_activation", true,
                           "use the last command as the state at activation");
  settings.action_monitor_rate =
      declarer.fixed<double>("action_monitor_rate", 20.0, "Hz, of feedback and results", at_least(0.1));
  const auto method = declarer.fixed<std::string>("interpolation_method", "splines", "between points",
                                                  one_of({"splines", "none"}));
  settings.interpolation = method == "none" ? Interpolation::none : Interpolation::splines;
  declarer.changeable<bool>("allow_nonzero_velocity_at_trajectory_end", false,
                            "the last point may have a velocity");
  declarer.changeable<double>("cmd_timeout", 0.0,
                              "s after the last point until the position is held; 0: none");
  for (const Names* names : {&settings.joints, &settings.ignored}) {
    for (const std::string& joint : *names) declare_gains(declarer, joint);
  }
  declare_constraints(declarer, settings);
  if (open_loop) {
    log_diagnostic(*context.log, context.name,
                   {Severity::warning, "control.jtc_deprecated", "'open_loop_control' is deprecated",
                    place_of(context, "open_loop_control"), "write interpolate_from_desired_state: true"});
  }
  return settings;
}

Status read_tuning(const Parameters& parameters, const Settings& settings, Tuning& tuning) {
  Tuning now;
  now.allow_partial_joints = get<bool>(parameters, "allow_partial_joints_goal");
  now.allow_integration = get<bool>(parameters, "allow_integration_in_goal_trajectories");
  now.allow_nonzero_velocity_at_end = get<bool>(parameters, "allow_nonzero_velocity_at_trajectory_end");
  now.cmd_timeout = get<double>(parameters, "cmd_timeout");
  now.tolerances.goal_time = get<double>(parameters, "constraints.goal_time");
  const double stopped = get<double>(parameters, "constraints.stopped_velocity_tolerance");
  for (const std::string& joint : settings.joints) {
    now.gains.push_back(gains_of(parameters, joint));
    if (Status fine = check_gains(now.gains.back()); !fine) {
      return Status::refused(fmt::format("gains of joint '{}': {}", joint, fine.why()));
    }
    now.feedforward.push_back(get<double>(parameters, "gains." + joint + ".ff_velocity_scale"));
    now.tolerances.path.push_back({get<double>(parameters, "constraints." + joint + ".trajectory"), 0, 0});
    now.tolerances.goal.push_back({get<double>(parameters, "constraints." + joint + ".goal"), stopped, 0});
  }
  tuning = std::move(now);
  return {};
}

Status check_configuration(const Settings& settings, std::vector<std::size_t>& joint_of_command) {
  const Names& joints = settings.joints;
  const Names& driven = settings.command_joints;
  if (driven.size() > joints.size()) {
    return Status::refused(
        fmt::format("'command_joints' has {} names and 'joints' only {}; list every command joint in "
                    "'joints' too",
                    driven.size(), joints.size()));
  }
  const bool rename =
      driven.size() == joints.size() &&
      !std::all_of(driven.begin(), driven.end(), [&](const auto& name) { return contains(joints, name); });
  joint_of_command.clear();
  for (std::size_t i = 0; i < driven.size(); ++i) {
    const auto found = std::find(joints.begin(), joints.end(), driven[i]);
    if (found == joints.end() && !rename) {
      return Status::refused(
          fmt::format("'command_joints' has '{}', which 'joints' does not{}; with fewer command joints "
                      "than joints they must be some of them",
                      driven[i], did_you_mean(driven[i], joints)));
    }
    joint_of_command.push_back(rename ? i : static_cast<std::size_t>(found - joints.begin()));
  }
  const bool needs_velocity = settings.commands(Kind::effort) || settings.commands_only(Kind::velocity);
  if (needs_velocity && !settings.measures(Kind::velocity)) {
    return Status::refused(fmt::format(
        "command_interfaces [{}] need the measured position and velocity; add velocity to "
        "state_interfaces [{}]",
        fmt::join(settings.command_interfaces, ", "), fmt::join(settings.state_interfaces, ", ")));
  }
  return {};
}

void warn_of_idle_settings(const ControllerContext& context, const Settings& settings, const Tuning& tuning) {
  const auto warn = [&](const char* rule, std::string message, std::string_view parameter, std::string fix) {
    log_diagnostic(
        *context.log, context.name,
        {Severity::warning, rule, std::move(message), place_of(context, parameter), std::move(fix)});
  };
  const std::string commands =
      fmt::format("command_interfaces [{}]", fmt::join(settings.command_interfaces, ", "));
  Names idle;
  for (std::size_t j = 0; j < settings.joints.size(); ++j) {
    const PidGains& gains = tuning.gains[j];
    const bool set = gains.p != 0 || gains.i != 0 || gains.d != 0 || tuning.feedforward[j] != 0;
    if (set && !settings.runs_pid()) idle.push_back(settings.joints[j]);
  }
  if (!idle.empty()) {
    const std::string prefix = "gains." + idle.front() + ".";
    std::string written = prefix + "p";
    for (const ParameterOverride& o : context.overrides->all()) {
      if (o.name.starts_with(prefix)) written = o.name;
    }
    warn("control.jtc_idle_gains",
         fmt::format("gains for {} have no effect: with {} no PID runs; {}", fmt::join(idle, ", "), commands,
                     settings.commands(Kind::effort) ? "the effort of the trajectory is passed on as it is"
                                                     : "stiffness is set by the servo"),
         written, "remove the gains, or command only velocity or only effort");
  }
  const bool velocity_error = settings.measures(Kind::velocity) &&
                              (settings.commands(Kind::velocity) || settings.commands(Kind::effort));
  constexpr const char* kStopped = "constraints.stopped_velocity_tolerance";
  if (!velocity_error && context.overrides->find(kStopped) != nullptr) {
    warn("control.jtc_idle_tolerance",
         fmt::format("stopped_velocity_tolerance has no effect on {}: velocity errors are computed only with "
                     "a measured velocity and a commanded velocity or effort, and this controller has {} and "
                     "state_interfaces [{}]",
                     fmt::join(settings.joints, ", "), commands, fmt::join(settings.state_interfaces, ", ")),
         kStopped, "use constraints.<joint>.goal");
  }
  if (settings.initial_scaling != 1 && !settings.commands_only(Kind::position)) {
    warn("control.jtc_idle_scaling",
         fmt::format("the initial scaling factor has no effect with {}", commands),
         "speed_scaling.initial_scaling_factor", "command position alone to scale the speed");
  }
}

}  // namespace doppel::jtc
