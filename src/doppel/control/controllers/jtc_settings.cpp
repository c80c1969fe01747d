#include "doppel/control/controllers/detail/jtc_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/control/controllers/detail/controller_parameters.h"
#include "doppel/control/controllers/detail/name_list.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel::jtc {
namespace {

using Names = std::vector<std::string>;

constexpr const char* kJtcParameter = "control.jtc_parameter";
const Names kKindNames = {kPosition, kVelocity, kAcceleration, kEffort};

const std::vector<Names> kCommandCombinations = {
    {kPosition}, {kPosition, kVelocity}, {kPosition, kVelocity, kAcceleration}, {kVelocity},
    {kEffort},   {kPosition, kEffort}};
const std::vector<Names> kStateCombinations = {
    {kPosition}, {kPosition, kVelocity}, {kPosition, kVelocity, kAcceleration}};

[[noreturn]] void refuse(const ControllerContext& context, const std::string& parameter, std::size_t element,
                         std::string message, std::string fix) {
  throw InputError(kJtcParameter, place_of(context, parameter, element),
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

void declare_lists(ControllerContext& context, Settings& settings) {
  Names listed, driven;
  declare_parameters(
      context,
      {{"command_interfaces", &settings.command_interfaces, "commanded interfaces, per joint", read_only()},
       {"state_interfaces", &settings.state_interfaces, "measured interfaces, per joint", read_only()},
       {"joints",
        &listed,
        "joints of the trajectories",
        read_only(),
        {kJtcParameter, ": '{}' is empty, so nothing can be moved", "list the joints"}},
       {"command_joints", &driven, "joints of the command interfaces; empty: as joints", read_only()}});
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
  settings.commanded = check_interfaces(context, "command_interfaces", settings.command_interfaces,
                                        kKindNames, kCommandCombinations);
  settings.measured = check_interfaces(context, "state_interfaces", settings.state_interfaces,
                                       {kPosition, kVelocity, kAcceleration}, kStateCombinations);
}

// All that can be changed at run time of these joints, as it is written.
struct Changeable {
  explicit Changeable(std::size_t joints)
      : i_clamp(joints, kInfinity), path(joints), goal(joints), gains(joints), feedforward(joints) {}

  Tuning tuning;
  double stopped_velocity = 0.01;
  std::vector<double> i_clamp, path, goal;  // [joints]
  std::vector<PidGains> gains;
  std::vector<double> feedforward;

  ControllerParameters list(const Names& joints) {
    ControllerParameters list{
        {"allow_partial_joints_goal", &tuning.allow_partial_joints, "trajectories may omit joints"},
        {"allow_integration_in_goal_trajectories", &tuning.allow_integration, "points may omit positions"},
        {"allow_nonzero_velocity_at_trajectory_end", &tuning.allow_nonzero_velocity_at_end,
         "the last point may have a velocity"},
        {"cmd_timeout", &tuning.cmd_timeout, "s after the last point until the position is held; 0: none"},
        {"constraints.stopped_velocity_tolerance", &stopped_velocity, "of every joint at the goal"},
        {"constraints.goal_time", &tuning.tolerances.goal_time, "s after the last point; 0: unlimited",
         minimum(0)}};
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const std::string gain = "gains." + joints[j] + ".", tolerance = "constraints." + joints[j] + ".";
      const ControllerParameters of_pid = gain_parameters(gains[j], gain, minimum(0));
      list.insert(list.end(), of_pid.begin(), of_pid.end());
      list.emplace_back(gain + "i_clamp", &i_clamp[j], "deprecated: i_clamp_max and minus i_clamp_min",
                        minimum(0));
      list.emplace_back(gain + "ff_velocity_scale", &feedforward[j], "times the velocity of the trajectory");
      list.emplace_back(gain + "antiwindup_strategy", &gains[j].antiwindup_strategy, "anti-windup strategy",
                        one_of({"legacy", "back_calculation", "conditional_integration", "none"}));
      list.emplace_back(tolerance + "trajectory", &path[j], "tolerance along the path; 0: not checked");
      list.emplace_back(tolerance + "goal", &goal[j], "tolerance at the goal; 0: not checked");
    }
    return list;
  }
};

}  // namespace

Settings declare_settings(ControllerContext& context) {
  Settings settings;
  declare_lists(context, settings);
  Names all = settings.joints;
  all.insert(all.end(), settings.ignored.begin(), settings.ignored.end());
  declare_parameters(context, Changeable(all.size()).list(all));
  bool open_loop = false;
  std::string method = "splines";
  settings.max_deceleration.resize(all.size());
  ControllerParameters list{
      {"speed_scaling.initial_scaling_factor", &settings.initial_scaling, "of trajectory time",
       read_only(minimum(0))},
      {"speed_scaling.state_interface", &settings.scaling_state,
       "full name of the interface that reports the scaling factor", read_only()},
      {"speed_scaling.command_interface", &settings.scaling_command,
       "full name of the interface that receives the scaling factor", read_only()},
      {"open_loop_control", &open_loop, "deprecated: interpolate_from_desired_state", read_only()},
      {"interpolate_from_desired_state", &settings.interpolate_from_desired, "start from the last command",
       read_only()},
      {"set_last_command_interface_value_as_state_on_activation", &settings.seed_from_commands,
       "use the last command as the state at activation", read_only()},
      {"action_monitor_rate", &settings.action_monitor_rate, "Hz, of feedback and results",
       read_only(minimum(0.1))},
      {"interpolation_method", &method, "between points", read_only(one_of({"splines", "none"}))},
      {"constraints.decelerate_on_cancel", &settings.decelerate_on_cancel,
       "brake at max_deceleration_on_cancel before holding", read_only()}};
  for (std::size_t j = 0; j < all.size(); ++j)
    list.emplace_back("constraints." + all[j] + ".max_deceleration_on_cancel", &settings.max_deceleration[j],
                      "per second squared", read_only(minimum(0)));
  declare_parameters(context, list);
  settings.max_deceleration.resize(settings.joints.size());
  settings.interpolate_from_desired = settings.interpolate_from_desired || open_loop;
  settings.interpolation = method == "none" ? Interpolation::none : Interpolation::splines;
  if (open_loop)
    report_parameter(context, "control.jtc_deprecated", "open_loop_control", "is deprecated",
                     "write interpolate_from_desired_state: true");
  return settings;
}

Status read_tuning(const Parameters& parameters, const Settings& settings, Tuning& tuning) {
  Changeable now(settings.joints.size());
  read_parameters(parameters, now.list(settings.joints));
  for (std::size_t j = 0; j < settings.joints.size(); ++j) {
    PidGains& gains = now.gains[j];
    gains.i_clamp_max = std::min(gains.i_clamp_max, now.i_clamp[j]);
    gains.i_clamp_min = std::max(gains.i_clamp_min, -now.i_clamp[j]);
    if (Status fine = check_gains(gains); !fine)
      return Status::refused(fmt::format("gains of joint '{}': {}", settings.joints[j], fine.why()));
    now.tuning.tolerances.path.push_back({now.path[j], 0, 0});
    now.tuning.tolerances.goal.push_back({now.goal[j], now.stopped_velocity, 0});
  }
  now.tuning.gains = std::move(now.gains);
  now.tuning.feedforward = std::move(now.feedforward);
  tuning = std::move(now.tuning);
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
