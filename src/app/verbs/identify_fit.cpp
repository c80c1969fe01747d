// doppel identify fit TARGET --recording BAG: the servos of the recorded joints, with intervals.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/identify.h"
#include "app/verbs/interruptible_work.h"
#include "doppel/base/core/names.h"
#include "doppel/review/identification/recorded_motion.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUsualSimulations = 1500;                // of a fit, for the progress
constexpr double kSlidingUnit = 1e3, kTurningUnit = 1e3;  // mm or mrad

struct FitVerb {
  std::vector<std::string> words;  // TARGET and its arguments
  std::string recording, last = "M2";
  std::vector<std::string> joints;
  bool json = false;
};

struct JointFit {
  std::string joint;
  bool slides = false;
  double seconds = 0;
  std::size_t samples = 0;
  ServoValues start{};
  ServoFit fit;
};

FrictionRung rung_named(const std::string& name) {
  std::vector<std::string> names;
  for (int i = 0; i < kFrictionRungs; ++i) {
    const auto rung = static_cast<FrictionRung>(i);
    if (name == name_of(rung)) return rung;
    names.emplace_back(name_of(rung));
  }
  throw InputError("cli.use", {}, fmt::format("there is no rung '{}'{}", name, did_you_mean(name, names)),
                   "M0, M1, M2, M3 or M4: doppel man identification.md");
}

// -- the joints

// Those that the options name, or all that are moved.
std::vector<std::string> chosen_joints(const FitVerb& options, const Model& model,
                                       const RecordedMotion& motion) {
  const std::vector<std::string> driven = model.driven_joint_names();
  for (const std::string& joint : options.joints) {
    if (std::ranges::find(driven, joint) != driven.end()) continue;
    throw InputError("cli.use", {},
                     fmt::format("the robot has no driven joint '{}'{}", joint, did_you_mean(joint, driven)),
                     "doppel tree lists links and joints");
  }
  if (!options.joints.empty()) return options.joints;
  std::vector<std::string> out;
  for (const std::string& joint : driven) {
    const auto found = motion.commanded.find(joint);
    const ModelJoint& described = model.joints[static_cast<std::size_t>(model.find_joint(joint))];
    if (found != motion.commanded.end() && is_moved(described, found->second)) out.push_back(joint);
  }
  return out;
}

void check_has_commands(const RecordedMotion& motion, const Model& model, const std::string& recording) {
  const std::vector<std::string> driven = model.driven_joint_names();
  const auto has_command = [&](const std::string& joint) { return motion.commanded.contains(joint); };
  if (std::ranges::any_of(driven, has_command)) return;
  const std::string why = motion.commanded.empty()
                              ? "the recording has no commanded positions"
                              : fmt::format("the recording commands no joint of the robot, but '{}'",
                                            motion.commanded.begin()->first);
  throw InputError("identify.no_commands", make_location(recording), why,
                   "record the motion with doppel identify record, or the topics controller_state of its "
                   "controllers and joint_states with doppel bag record");
}

// -- the texts

std::string assessment(const ServoFit& fit, ServoQuantity quantity) {
  const FittedValue& value = fit[quantity];
  if (!value.fitted) return fmt::format("not of {}", name_of(fit.rung));
  if (!value.problem.empty()) return value.problem;
  if (std::ranges::find(fit.at_bound, quantity) != fit.at_bound.end()) return "at the bound of the fit";
  return fit.is_trusted(quantity) ? "identified" : "identified, if the model fits: see the warnings";
}

bool is_identified(const ServoFit& fit, ServoQuantity quantity) {
  return fit[quantity].fitted && fit[quantity].problem.empty() &&
         std::ranges::find(fit.at_bound, quantity) == fit.at_bound.end();
}

std::vector<ServoQuantity> fitted_quantities(const ServoFit& fit) {
  std::vector<ServoQuantity> out;
  for (std::size_t i = 0; i < kServoQuantities; ++i) {
    if (fit.values[i].fitted) out.push_back(static_cast<ServoQuantity>(i));
  }
  return out;
}

bool has_result(const ServoFit& fit) {
  return std::ranges::any_of(fitted_quantities(fit),
                             [&](ServoQuantity one) { return is_identified(fit, one); });
}

std::string fit_table(const JointFit& one) {
  const ServoFit& fit = one.fit;
  std::string out = fmt::format("{}: {} samples of {:.1f} s, model {}\n", one.joint, one.samples, one.seconds,
                                name_of(fit.rung));
  out += fmt::format("  {:<12}{:>10}  {:<22}{:<12}{:>10}  {}\n", "", "value", "95 % interval", "unit",
                     "start", "assessment");
  for (const ServoQuantity quantity : fitted_quantities(fit)) {
    const FittedValue& value = fit[quantity];
    out += fmt::format("  {:<12}{:>10.4g}  {:<22}{:<12}{:>10.4g}  {}\n", name_of(quantity), value.value,
                       fmt::format("{:.4g} to {:.4g}", value.low, value.high), unit_of(quantity, one.slides),
                       one.start[static_cast<std::size_t>(quantity)], assessment(fit, quantity));
  }
  const double unit = one.slides ? kSlidingUnit : kTurningUnit;
  const char* name = one.slides ? "mm" : "mrad";
  out += fmt::format(
      "  residuals: rms {:.3g} {}, held out {:.3g} {}; {}; {:.2g} % of their variance is of "
      "effects that the model lacks\n",
      unit * fit.rms, name, unit * fit.held_out_rms, name,
      fit.tick > 0 ? fmt::format("one tick is {:.3g} {}", unit * fit.tick, name)
                   : "positions are not rounded",
      100 * fit.structure);
  for (const CorrelatedPair& pair : fit.correlated)
    out += fmt::format("  {} and {} are correlated by {:.3f}\n", name_of(pair.a), name_of(pair.b),
                       pair.correlation);
  for (const std::string& warning : fit.warnings) out += "  warning: " + warning + "\n";
  return out;
}

Json fit_json(const JointFit& one) {
  const ServoFit& fit = one.fit;
  Json out{{"joint", one.joint},
           {"samples", one.samples},
           {"seconds", one.seconds},
           {"model", name_of(fit.rung)},
           {"values", Json::object()}};
  for (const ServoQuantity quantity : fitted_quantities(fit)) {
    const FittedValue& value = fit[quantity];
    out["values"][std::string(name_of(quantity))] = {{"value", value.value},
                                                     {"low", value.low},
                                                     {"high", value.high},
                                                     {"unit", unit_of(quantity, one.slides)},
                                                     {"start", one.start[static_cast<std::size_t>(quantity)]},
                                                     {"identified", is_identified(fit, quantity)},
                                                     {"trusted", fit.is_trusted(quantity)},
                                                     {"assessment", assessment(fit, quantity)}};
  }
  out["correlated"] = Json::array();
  for (const CorrelatedPair& pair : fit.correlated)
    out["correlated"].push_back(
        {{"a", name_of(pair.a)}, {"b", name_of(pair.b)}, {"correlation", pair.correlation}});
  out["residuals"] = {{"rms", fit.rms},
                      {"held_out_rms", fit.held_out_rms},
                      {"tick", fit.tick},
                      {"structure", fit.structure},
                      {"white_probability", fit.white_probability}};
  out["warnings"] = fit.warnings;
  return out;
}

// -- the work

JointFit fit_joint(const Model& model, const std::string& joint, const RecordedMotion& motion,
                   const ServoParameters& servo, const FitOptions& how) {
  const Eigen::Vector3d gravity(0, 0, -9.81);
  const ModelJoint& described = model.joints[static_cast<std::size_t>(model.find_joint(joint))];
  const JointRecord record = joint_record(model, joint, motion, gravity);
  JointFit out;
  out.joint = joint;
  out.slides = described.type == JointType::prismatic;
  out.samples = record.time.size();
  out.seconds = record.time.empty() ? 0 : record.time.back() - record.time.front();
  out.start = start_values(described, servo, record);
  FitOptions options = how;
  options.start = out.start;
  out.fit = fit_servo(record, options);
  return out;
}

std::vector<JointFit> fit_joints(const FitVerb& verb, const Model& model, const RecordedMotion& motion,
                                 const std::vector<std::string>& joints) {
  const std::vector<ServoParameters> servos = choose_servos(model, ServoOptions{}, {0, 0, -9.81});
  const InterruptibleWork work("of the fits");
  std::vector<JointFit> out;
  FitOptions how;
  how.last = rung_named(verb.last);
  how.progress = [&](int simulations) {
    const double part = 0.99 * std::min(simulations / kUsualSimulations, 1.0);
    return work.progress((static_cast<double>(out.size()) + part) / static_cast<double>(joints.size()));
  };
  for (const std::string& joint : joints) {
    const auto index = static_cast<std::size_t>(model.find_joint(joint));
    out.push_back(fit_joint(model, joint, motion, servos[index], how));
  }
  static_cast<void>(work.progress(1));
  return out;
}

int run_fit(const FitVerb& verb) {
  static_cast<void>(rung_named(verb.last));
  DescriptionTarget target = open_target(verb.words);
  const RobotDescription robot = load_target(target).robot;
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  print_diagnostics(diagnostics);
  BagReader bag(verb.recording);
  const RecordedMotion motion = read_recorded_motion(bag);
  std::vector<std::string> joints = chosen_joints(verb, model, motion);
  check_has_commands(motion, model, verb.recording);
  if (joints.empty()) {
    throw InputError("identify.no_motion", make_location(verb.recording),
                     "no command of a joint changes in the recording",
                     "record a motion: doppel identify record");
  }
  std::vector<JointFit> fits;
  try {
    fits = fit_joints(verb, model, motion, joints);
  } catch (const FitCancelled&) {
    return interrupted_without_output();
  }
  Json json{{"version", 1}, {"robot", robot.name}, {"recording", verb.recording}, {"joints", Json::array()}};
  std::string text;
  for (const JointFit& one : fits) {
    json["joints"].push_back(fit_json(one));
    text += (text.empty() ? "" : "\n") + fit_table(one);
  }
  deliver(verb.json ? json.dump(2) + "\n" : text);
  return std::ranges::any_of(fits, [](const JointFit& one) { return has_result(one.fit); }) ? 0 : 1;
}

}  // namespace

void add_identify_fit(CLI::App& group, int& exit_code) {
  const auto options = std::make_shared<FitVerb>();
  CLI::App* verb = group.add_subcommand(
      "fit", "Stiffness, damping, friction, delay and limits of servos, with intervals, from a recording");
  add_target(*verb, options->words);
  verb->add_option("--recording", options->recording,
                   "The bag, a folder or a file, as identify record makes it")
      ->required()
      ->type_name("BAG");
  verb->add_option("--joint", options->joints, "Only this joint; repeatable (default: all that are moved)")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("JOINT");
  verb->add_option("--last", options->last,
                   "The last rung of the friction models that are tried: M0 none, M1 Coulomb and viscous, M2 "
                   "Stribeck, M3 load, M4 backlash")
      ->capture_default_str()
      ->type_name("RUNG");
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in s, rad, m, N m");
  verb->footer(
      "Exit code 1: nothing could be identified.\n"
      "Examples:\n  doppel identify fit omarm_one --recording motions\n"
      "  doppel identify fit my_arm.urdf.xacro --recording run.mcap --joint \"Revolute 2\" --json\n"
      "See doppel man identification.md");
  verb->callback([options, &exit_code] { exit_code = run_fit(*options); });
}

}  // namespace doppel::app
