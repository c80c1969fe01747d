// The fits of a recording: which joints, their tables, and the evidence of a recording.
#include "app/verbs/identify_fits.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "app/print_stderr.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/shell.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/sha256.h"
#include "doppel/physics/contract/described_servo.h"
#include "doppel/review/identification/recorded_motion.h"
#include "doppel/review/identification/servo_operation.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel::app {
namespace {

constexpr double kUsualSimulations = 1500;                // of a fit, for the progress
constexpr double kSlidingUnit = 1e3, kTurningUnit = 1e3;  // mm or mrad
constexpr std::size_t kMaxHashedBytes = std::size_t{1} << 30U;
constexpr std::size_t kHashDigits = 16;  // of SHA-256 in an evidence

struct Recording {
  MeasuredMotion motion;
  Model model;  // with the weight that the robot carried
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

// Those that the options name, or all that are moved in one of the recordings.
std::vector<std::string> chosen_joints(const FitRequest& options, const Model& model,
                                       const std::vector<Recording>& recordings) {
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
    const ModelJoint& described = model.joints[static_cast<std::size_t>(model.find_joint(joint))];
    const auto moves = [&](const Recording& one) {
      const auto found = one.motion.commanded.find(joint);
      return found != one.motion.commanded.end() && is_moved(described, found->second);
    };
    if (std::ranges::any_of(recordings, moves)) out.push_back(joint);
  }
  return out;
}

void check_has_commands(const MeasuredMotion& motion, const Model& model, const std::string& recording) {
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

// Those in which the joint moves, one after the other.
JointRecord record_of(const std::vector<Recording>& recordings, const ModelJoint& joint) {
  std::vector<JointRecord> out;
  for (const Recording& one : recordings) {
    const auto found = one.motion.commanded.find(joint.name);
    const bool moves = found != one.motion.commanded.end() && is_moved(joint, found->second);
    if (!moves && recordings.size() > 1) continue;
    out.push_back(joint_record(one.model, joint.name, one.motion, {0, 0, -9.81}));
  }
  if (out.empty()) {
    throw InputError("identify.no_motion", {},
                     fmt::format("the command of '{}' does not change in any of the recordings", joint.name),
                     "record a motion of the joint: doppel identify record");
  }
  return joined_records(out);
}

JointFit fit_joint(const Model& model, const std::string& joint, const std::vector<Recording>& recordings,
                   const ServoParameters& servo, const FitOptions& how) {
  const ModelJoint& described = model.joints[static_cast<std::size_t>(model.find_joint(joint))];
  JointFit out;
  out.record = record_of(recordings, described);
  const JointRecord& record = out.record;
  out.joint = joint;
  out.slides = described.type == JointType::prismatic;
  out.seconds = record.time.empty() ? 0 : record.time.back() - record.time.front();
  out.start = start_values(described, servo, record);
  FitOptions options = how;
  options.start = out.start;
  out.fit = fit_servo(record, options);
  return out;
}

std::vector<JointFit> fit_joints(const FitRequest& request, const RobotDescription& robot, const Model& model,
                                 const std::vector<Recording>& recordings,
                                 const std::vector<std::string>& joints) {
  const std::vector<ServoParameters> servos = choose_servos(robot, model, ServoOptions{}, {0, 0, -9.81});
  const InterruptibleWork work("of the fits");
  std::vector<JointFit> out;
  FitOptions how;
  how.last = rung_named(request.last);
  how.progress = [&](int simulations) {
    const double part = 0.99 * std::min(simulations / kUsualSimulations, 1.0);
    return work.progress((static_cast<double>(out.size()) + part) / static_cast<double>(joints.size()));
  };
  for (const std::string& joint : joints) {
    const auto index = static_cast<std::size_t>(model.find_joint(joint));
    out.push_back(fit_joint(model, joint, recordings, servos[index], how));
  }
  static_cast<void>(work.progress(1));
  return out;
}

// The bytes of the bag's files, in the order of their names.
std::string hash_of_recording(const std::string& recording) {
  namespace fs = std::filesystem;
  std::vector<fs::path> files;
  if (fs::is_directory(recording)) {
    for (const auto& entry : fs::directory_iterator(recording)) {
      if (entry.path().extension() != ".yaml" && entry.is_regular_file()) files.push_back(entry.path());
    }
  } else {
    files.emplace_back(recording);
  }
  std::ranges::sort(files);
  std::string hashes;
  for (const fs::path& file : files) hashes += sha256_hex(read_file(file.string(), kMaxHashedBytes));
  return (files.size() == 1 ? hashes : sha256_hex(hashes)).substr(0, kHashDigits);
}

// Each recording with the weight that it names; --payload is that of the last one.
std::vector<Recording> read_recordings(const FitRequest& request, const Model& model) {
  std::vector<Recording> out;
  for (std::size_t i = 0; i < request.recordings.size(); ++i) {
    const std::string& name = request.recordings[i];
    std::optional<Payload> payload = recorded_payload(name);
    const std::optional<Payload> named =
        i + 1 == request.recordings.size() ? payload_of(request.payload) : std::nullopt;
    if (payload && named && payload_text(*payload) != payload_text(*named)) {
      throw InputError("cli.use", make_location(name),
                       fmt::format("the recording was made with {:.4g} kg at '{}', not with --payload {}",
                                   payload->mass, payload->link, request.payload.payload),
                       "leave --payload out");
    }
    if (named) payload = named;
    BagReader bag(name);
    out.push_back({read_recorded_motion(bag), payload ? loaded_model(model, *payload) : model});
    check_has_commands(out.back().motion, model, name);
    if (payload)
      print_note(fmt::format("note: {}: with {:.4g} kg at '{}'", name, payload->mass,
                             payload_link(model, *payload)));
  }
  return out;
}

}  // namespace

std::string assessment(const ServoFit& fit, ServoQuantity quantity) {
  const FittedValue& value = fit[quantity];
  if (!value.fitted) return fmt::format("not of {}", name_of(fit.rung));
  if (!value.problem.empty()) return value.problem;
  if (std::ranges::find(fit.at_bound, quantity) != fit.at_bound.end()) return "at the bound of the fit";
  return fit.is_trusted(quantity) ? "identified" : "identified, if the model fits: see the warnings";
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
                             [&](ServoQuantity one) { return fit.is_identified(one); });
}

std::string fit_table(const JointFit& one) {
  const ServoFit& fit = one.fit;
  const std::size_t releases = one.record.released.size();
  std::string out = fmt::format(
      "{}: {} samples of {:.1f} s, {}model {}\n", one.joint, one.fit.predicted.size(), one.seconds,
      releases > 0 ? fmt::format("{} releases of the torque, ", releases) : "", name_of(fit.rung));
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

std::string recording_evidence(const std::vector<std::string>& recordings) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  char date[16];
  std::strftime(date, sizeof date, "%Y-%m-%d", &parts);
  std::string out;
  for (const std::string& recording : recordings) {
    const std::string name = std::filesystem::path(recording).lexically_normal().filename().string();
    out += fmt::format("{}, sha256 {}, ", name.empty() ? recording : name, hash_of_recording(recording));
  }
  return out + date;
}

std::optional<RecordingFits> fit_recording(const FitRequest& request) {
  static_cast<void>(rung_named(request.last));
  RecordingFits out{open_target(request.words), {}, {}};
  const RobotDescription robot = load_target(out.target).robot;
  out.robot = robot.name;
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  print_diagnostics(diagnostics);
  const std::vector<Recording> recordings = read_recordings(request, model);
  const std::vector<std::string> joints = chosen_joints(request, model, recordings);
  if (joints.empty()) {
    throw InputError("identify.no_motion", make_location(request.recordings.front()),
                     "no command of a joint changes in the recording",
                     "record a motion: doppel identify record");
  }
  try {
    out.joints = fit_joints(request, robot, model, recordings, joints);
  } catch (const FitCancelled&) {
    return {};
  }
  return out;
}

void add_fit_request(CLI::App& verb, FitRequest& request) {
  add_target(verb, request.words);
  verb.add_option(
          "--recording", request.recordings,
          "The bag, a folder or a file, as identify record makes it; repeatable: without and with a weight")
      ->required()
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("BAG");
  add_payload_options(verb, request.payload,
                      "The known weight in the last recording, where the recording does not name it");
  verb.add_option("--joint", request.joints, "Only this joint; repeatable (default: all that are moved)")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("JOINT");
  verb.add_option("--last", request.last,
                  "The last rung of the friction models that are tried: M0 none, M1 Coulomb and viscous, M2 "
                  "Stribeck, M3 load, M4 backlash")
      ->capture_default_str()
      ->type_name("RUNG");
}

}  // namespace doppel::app
