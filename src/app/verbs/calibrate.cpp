// doppel calibrate: from measurements at the machine to corrections in the overlay, or to a driver's offsets.
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/description_target.h"
#include "app/verbs/live_positions.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/math/units.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/calibration/calibration.h"
#include "doppel/review/calibration/corrections.h"
#include "doppel/review/calibration/lerobot.h"

namespace doppel::app {
namespace {

struct CalibrateOptions {
  std::vector<std::string> words, measure;
  std::string lerobot, limits = "keep";
  bool as_offsets = false, dry_run = false, json = false;
  bool live = false, yes = false;  // positions of the machine are read, and not typed
  std::vector<std::string> joints;
  std::string component, port;
};

// One joint's way from measurements to operations.
struct Result {
  const Joint* joint = nullptr;
  std::vector<Measurement> measurements;
  JointFit fit;
  std::vector<Operation> operations;
  Eigen::Vector3d rpy = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::Zero();  // corrected
};

class Calibration {
 public:
  explicit Calibration(const CalibrateOptions& options)
      : options_(options), target_(open_target(options.words)) {
    Diagnostics diagnostics;
    expanded_ =
        expand_description(target_.target.description, target_.arguments, target_.resolver, diagnostics);
    overlays_ = apply_overlays(expanded_, target_.resolver, diagnostics);
    robot_ = read_description(expanded_, target_.resolver, diagnostics);
    diagnostics.throw_if_errors();
    print_diagnostics(diagnostics);
  }

  int run() {
    for (const std::string& text : options_.measure) {
      const NamedMeasurements named = parse_measurements(text, robot_);
      measured(named.joint, named.measurements);
    }
    if (!options_.lerobot.empty()) take_lerobot();
    if (options_.live) measure_live();
    if (measured_.empty() && !options_.live) ask();
    if (measured_.empty()) return 1;
    for (auto& [joint, measurements] : measured_) results_.push_back(fit(*joint, std::move(measurements)));
    for (const Result& result : results_)
      refuse_repetition(result.joint->name, result.operations, overlays_, options_.words.front());
    if (options_.as_offsets) {
      for (const std::string& warning : baked_zeros()) print_note("warning: " + warning);
      options_.json ? print_offsets_json() : print_offsets();
      return 0;
    }
    correct();
    const std::filesystem::path file = write();
    try {
      options_.json ? print_json(file) : print_text(file);
    } catch (const OutputClosed&) {  // stdout was closed (| head)
    }
    return 0;
  }

 private:
  void measured(const std::string& name, const std::vector<Measurement>& measurements) {
    const Joint* joint = robot_.find_joint(name);
    for (auto& [known, all] : measured_) {
      if (known == joint)
        return static_cast<void>(all.insert(all.end(), measurements.begin(), measurements.end()));
    }
    measured_.emplace_back(joint, measurements);
  }

  // Assumes that the ends of the swept range are the stops at the description's limits.
  void take_lerobot() {
    std::vector<std::string> names;
    for (const Joint& joint : robot_.joints) names.push_back(joint.name);
    for (const LerobotMotor& motor : read_lerobot_calibration(options_.lerobot)) {
      const Joint* joint = robot_.find_joint(motor.name);
      if (joint == nullptr) {
        print_note(fmt::format("note: the motor '{}' is not a joint of this robot{}; it is ignored",
                               motor.name, did_you_mean(motor.name, names)));
      } else if (!joint->limits || !joint->limits->has_position) {
        print_note(fmt::format("note: '{}' has no limits to compare the swept range with; it is ignored",
                               motor.name));
      } else {
        measured(motor.name, {{joint->limits->lower, motor.lower()}, {joint->limits->upper, motor.upper()}});
      }
    }
    if (!measured_.empty()) {
      print_note(
          "note: the ends of LeRobot's swept ranges are assumed to be the joint limits of the description; "
          "measure two poses of a joint (--measure) if that does not hold");
    }
  }

  Result fit(const Joint& joint, std::vector<Measurement> measurements) const {
    Result result;
    result.joint = &joint;
    result.measurements = std::move(measurements);
    JointCorrection correction = correct_joint(
        joint, result.measurements, options_.limits == "move" ? LimitChoice::move : LimitChoice::keep);
    result.fit = std::move(correction.fit);
    result.operations = std::move(correction.operations);
    return result;
  }

  // A driver's offset is added to a zero correction that the model contains.
  [[nodiscard]] std::vector<std::string> baked_zeros() const {
    std::vector<std::string> out;
    for (const Result& result : results_) {
      for (const AppliedOverlay& one : overlays_) {
        for (const std::size_t i : zeros_of(one.overlay.operations, result.joint->name)) {
          out.push_back(
              fmt::format("'{}' is corrected in the overlay ({}: {}); these offsets are valid together with "
                          "that correction and wrong without it",
                          result.joint->name, i + 1, describe(one.overlay.operations[i].action)));
        }
      }
    }
    return out;
  }

  void correct() {
    for (Result& result : results_) apply_in_order(result.operations, expanded_, target_.resolver);
    Diagnostics ignored;
    const RobotDescription corrected = read_description(expanded_, target_.resolver, ignored);
    for (Result& result : results_) {
      const Joint* joint = corrected.find_joint(result.joint->name);
      result.rpy = joint->origin.rpy;
      result.axis = joint->axis;
    }
  }

  std::filesystem::path write() const {
    std::vector<Operation> all;
    for (const Result& result : results_)
      all.insert(all.end(), result.operations.begin(), result.operations.end());
    if (all.empty() || options_.dry_run) return {};
    if (asked_ && !options_.yes && !agreed("write this to the overlay?")) return {};
    return add_to_overlay(target_.target.description, all);
  }

  static std::string unit(const Joint& joint) { return joint.type == JointType::prismatic ? "mm" : "deg"; }
  static double in_unit(const Joint& joint, double value) {
    return joint.type == JointType::prismatic ? value * 1e3 : value / kDegree;
  }

  void print_fit(const Result& result) const {
    const Joint& joint = *result.joint;
    const JointFit& fit = result.fit;
    print_line("{}\n", joint.name);
    print_line("  direction  {}\n", fit.direction < 0 ? "the machine turns the other way" : "the same");
    print_line("  zero       the machine reads {:.4f} {} where the model is at 0\n",
               in_unit(joint, fit.offset), unit(joint));
    print_line("  scale      {:.6g} machine units per model unit\n", fit.scale);
    print_line("  residuals ");
    for (const double residual : fit.residuals) print_line(" {:+.3f}", in_unit(joint, residual));
    print_line(" {}\n", unit(joint));
    for (const std::string& doubt : doubts_about(joint, fit, result.measurements))
      print_line("  warning    {}\n", doubt);
  }

  void print_text(const std::filesystem::path& file) const {
    for (const Result& result : results_) {
      print_fit(result);
      if (result.operations.empty()) print_line("  nothing to correct\n");
      for (const Operation& operation : result.operations)
        print_line("  correction {}\n", describe(operation.action));
      if (!result.operations.empty()) {
        const Eigen::Vector3d none = Eigen::Vector3d::Zero(), axis = result.axis + none,
                              rpy = result.rpy + none;
        print_line("             axis {:.9g} {:.9g} {:.9g}, rpy {:.10g} {:.10g} {:.10g}\n", axis.x(),
                   axis.y(), axis.z(), rpy.x(), rpy.y(), rpy.z());
      }
    }
    if (!file.empty()) print_line("written to {}\n", file.string());
    if (options_.dry_run) print_line("nothing was written (--dry-run)\n");
    const bool baked =
        std::any_of(results_.begin(), results_.end(), [](const Result& r) { return !r.operations.empty(); });
    if (baked) {
      print_line(
          "remove the driver's offsets for these joints: in both places they would be applied twice\n");
      if (options_.limits == "keep") {
        print_line(
            "the limits keep their values, now in machine angles; --limits move keeps their physical "
            "positions instead\n");
      }
    }
  }

  void print_offsets() const {
    for (const Result& result : results_) {
      print_fit(result);
      print_line("  <joint name=\"{}\">\n", escape_xml(result.joint->name, true));
      print_line("    <param name=\"servo_direction\">{}</param>\n", result.fit.direction);
      print_line("    <param name=\"servo_offset_{}\">{:.9g}</param>\n", unit(*result.joint),
                 in_unit(*result.joint, result.fit.offset));
      print_line("    <param name=\"servo_scale\">{:.9g}</param>\n", result.fit.scale);
      print_line("  </joint>\n");
    }
    print_line(
        "the driver computes machine = direction * scale * model + offset; the description is unchanged\n");
  }

  void print_offsets_json() const {
    nlohmann::ordered_json out;
    out["version"] = 1;
    out["joints"] = nlohmann::ordered_json::array();
    for (const Result& result : results_) {
      out["joints"].push_back({{"joint", result.joint->name},
                               {"servo_direction", result.fit.direction},
                               {"unit", unit(*result.joint)},
                               {"servo_offset", in_unit(*result.joint, result.fit.offset)},
                               {"servo_scale", result.fit.scale},
                               {"residuals", result.fit.residuals}});
    }
    out["rule"] = "machine = direction * scale * model + offset";
    out["warnings"] = baked_zeros();
    print_line("{}\n", out.dump(2));
  }

  void print_json(const std::filesystem::path& file) const {
    nlohmann::ordered_json out;
    out["version"] = 1;
    out["joints"] = nlohmann::ordered_json::array();
    for (const Result& result : results_) {
      nlohmann::ordered_json joint;
      joint["joint"] = result.joint->name;
      joint["direction"] = result.fit.direction;
      joint["offset"] = result.fit.offset;
      joint["scale"] = result.fit.scale;
      joint["residuals"] = result.fit.residuals;
      joint["axis"] = {result.axis.x(), result.axis.y(), result.axis.z()};
      joint["rpy"] = {result.rpy.x(), result.rpy.y(), result.rpy.z()};
      joint["operations"] = nlohmann::ordered_json::array();
      for (const Operation& operation : result.operations)
        joint["operations"].push_back(describe(operation.action));
      out["joints"].push_back(std::move(joint));
    }
    out["written"] = file.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(file.string());
    print_line("{}\n", out.dump(2));
  }

  // -- interactive questions
  static std::string answer(const std::string& question) {
    print_out(question);
    std::string line;
    if (!std::getline(std::cin, line))
      throw InputError("calibrate.ended", {}, "the input ends before the measurements are complete");
    const std::size_t begin = line.find_first_not_of(" \t"), end = line.find_last_not_of(" \t\r");
    return begin == std::string::npos ? "" : line.substr(begin, end - begin + 1);
  }
  static bool agreed(const std::string& question) {
    const std::string reply = answer(question + " [y/N] ");
    return reply == "y" || reply == "Y" || reply == "yes";
  }

  void ask() {
    if (isatty(STDIN_FILENO) == 0) {
      throw InputError("calibrate.nothing", {}, "there are no measurements",
                       "give --measure \"JOINT: MODEL=MACHINE MODEL=MACHINE\", or --lerobot FILE");
    }
    asked_ = true;
    std::vector<std::string> names;
    for (const Joint& joint : robot_.joints) {
      if (joint.type != JointType::fixed && !joint.mimic) names.push_back(joint.name);
    }
    print_line("The joints of '{}':\n", robot_.name);
    for (std::size_t i = 0; i < names.size(); ++i) print_line("  {:>2}  {}\n", i + 1, names[i]);
    while (true) {
      std::string name = answer("joint, by number or name (empty: done): ");
      if (name.empty()) return;
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (name == std::to_string(i + 1)) name = names[i];
      }
      if (std::find(names.begin(), names.end(), name) == names.end()) {
        print_line("  no such joint{}\n", did_you_mean(name, names));
        continue;
      }
      ask_poses(name);
    }
  }

  // Poses are made with the arm; the machine reports its own positions.
  void measure_live() {
    HardwareOptions hardware;
    hardware.words = options_.words;
    hardware.component = options_.component;
    hardware.port = options_.port;
    live_ = open_live_positions(hardware, options_.yes);
    if (live_ == nullptr) return;
    asked_ = true;
    print_line("The machine's positions come from {}.\n", live_->source());
    for (const std::string& name : live_joints()) {
      const Joint& joint = *robot_.find_joint(name);
      print_line("'{}': move it to two poses at least 60 degrees apart that can be measured{}.\n", name,
                 live_suggestion(joint));
      ask_poses(name);
    }
  }

  // Those that were named, or all that the machine reports and the model can turn.
  [[nodiscard]] std::vector<std::string> live_joints() const {
    const std::vector<std::string> reported = live_->joints();
    std::vector<std::string> out;
    for (const std::string& name : options_.joints) {
      if (std::ranges::find(reported, name) == reported.end())
        throw InputError(
            "calibrate.joint", {},
            fmt::format("the machine reports no joint '{}'{}", name, did_you_mean(name, reported)));
      out.push_back(name);
    }
    if (!out.empty()) return out;
    for (const Joint& joint : robot_.joints) {
      const bool moves = joint.type != JointType::fixed && !joint.mimic;
      if (moves && std::ranges::find(reported, joint.name) != reported.end()) out.push_back(joint.name);
    }
    return out;
  }

  static std::string live_suggestion(const Joint& joint) {
    const auto poses = suggested_poses(joint);
    if (!poses) return "";
    return fmt::format(", for instance {:.4g} and {:.4g} {} of the model as doppel view shows it",
                       in_unit(joint, poses->front()), in_unit(joint, poses->back()), unit(joint));
  }

  // The machine's position in the present pose, as a typed answer has it.
  std::string machine_position(const std::string& name, int pose) {
    if (live_ == nullptr) return number_answer(fmt::format("  pose {}: machine position: ", pose), false);
    while (true) {
      try {
        const double position = in_unit(*robot_.find_joint(name), live_->position(name));
        print_line("  pose {}: the machine is at {:.3f}\n", pose, position);
        return fmt::format("{:.6f}", position);
      } catch (const InputError& problem) {
        print_line("  {}\n", problem.what());
        if (!agreed("  measure it again?")) throw;
      }
    }
  }

  void ask_poses(const std::string& name) {
    if (live_ == nullptr)
      print_line(
          "Move the model and the machine to the same pose, at two or more poses at least 60 degrees "
          "apart.\n");
    std::string text = name + ":";
    for (int pose = 1;; ++pose) {
      const std::string model =
          number_answer(fmt::format("  pose {}: model position (degrees, mm; empty: fit): ", pose), true);
      if (!model.empty()) {
        text += " " + model + "=" + machine_position(name, pose);
      } else if (pose == 1 || fitted(name, text)) {
        return;
      } else if (!agreed("  measure more poses of it? The previous ones are kept.")) {
        return;
      } else {
        --pose;
      }
    }
  }

  // Repeats the question until the answer is a number.
  static std::string number_answer(const std::string& question, bool may_be_empty) {
    while (true) {
      std::string reply = answer(question);
      if ((may_be_empty && reply.empty()) || measured_number(reply)) return reply;
      print_line("  '{}' is not a number; enter for example 45 or -12.5\n", reply);
    }
  }

  bool fitted(const std::string& name, const std::string& text) {
    try {
      const NamedMeasurements named = parse_measurements(text, robot_);
      print_fit(fit(*robot_.find_joint(name), named.measurements));
      measured(name, named.measurements);
      return true;
    } catch (const InputError& problem) {
      print_line("{}\n", problem.what());
      return false;
    }
  }

  const CalibrateOptions& options_;
  DescriptionTarget target_;
  ExpandedDescription expanded_;
  RobotDescription robot_;
  std::vector<AppliedOverlay> overlays_;
  std::vector<std::pair<const Joint*, std::vector<Measurement>>> measured_;
  std::vector<Result> results_;
  bool asked_ = false;
  std::unique_ptr<LivePositions> live_;  // nullptr: the machine's positions are typed
};

void declare_live(CLI::App& verb, CalibrateOptions& options) {
  verb.add_flag(
      "--live", options.live,
      "The machine's positions are read: from the running robot, or from its servos without torque");
  verb.add_option("--joint", options.joints, "With --live: only this joint; may be repeated")
      ->needs("--live");
  verb.add_option("--component", options.component, "With --live: of several <ros2_control> blocks")
      ->type_name("NAME")
      ->needs("--live");
  CLI::Option* const serial =
      verb.add_option("--serial", options.port, "With --live: the port of the servos' bus")
          ->type_name("PORT")
          ->needs("--live");
  verb.add_option("--port", options.port,
                  "With --live: the number of a running robot's server, or the port of the servos' bus")
      ->excludes(serial)
      ->type_name("PORT")
      ->needs("--live");
  verb.add_flag("--yes", options.yes, "Questions are answered with yes");
}

}  // namespace

void add_calibrate(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App* verb =
      app.add_subcommand("calibrate", "Calibrate the model's joint angles to the machine from measurements");
  add_target(*verb, options->words);
  verb->add_option("--measure", options->measure,
                   "\"JOINT: MODEL=MACHINE MODEL=MACHINE ...\": positions of model and machine at the same "
                   "pose, in degrees (mm for prismatic joints); two or more, at least 60 degrees apart")
      ->take_all();
  verb->add_option("--lerobot", options->lerobot,
                   "LeRobot calibration file (JSON): its swept ranges are the measurements");
  declare_live(*verb, *options);
  verb->add_option("--limits", options->limits,
                   "keep: limits keep their values; move: limits keep their physical positions")
      ->check(CLI::IsMember({"keep", "move"}));
  verb->add_flag("--as-offsets", options->as_offsets,
                 "Print driver offsets instead of correcting the description");
  verb->add_flag("--dry-run", options->dry_run, "Print the corrections without writing them");
  verb->add_flag("--json", options->json, "Print a JSON object to stdout");
  verb->footer(
      "Examples:\n"
      "  doppel calibrate my_arm.xacro                     # asks for joints and poses\n"
      "  doppel calibrate my_arm.xacro --measure \"Revolute 2: 0=45 90=135\" --measure \"Revolute 3: 0=55 "
      "90=145\"\n"
      "  doppel calibrate my_arm.xacro --live              # positions are read; the arm is moved by hand\n"
      "  doppel calibrate so101.urdf --lerobot "
      "~/.cache/huggingface/lerobot/calibration/robots/so101_follower/arm.json\n"
      "Corrections go into the overlay beside the description (doppel overlay show).");
  verb->callback([options, &exit_code] { exit_code = Calibration(*options).run(); });
}

}  // namespace doppel::app
