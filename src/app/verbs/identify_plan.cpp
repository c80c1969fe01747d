// doppel identify plan TARGET: a motion for the identification of an arm's servos, as a file.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "app/description_target.h"
#include "app/output.h"
#include "app/verbs/identify.h"
#include "app/verbs/position_text.h"
#include "app/verbs/shell.h"
#include "doppel/base/core/names.h"
#include "doppel/review/identification/motion_plan.h"
#include "doppel/scenario/compile/simulated_hardware.h"

namespace doppel::app {
namespace {

struct PlanVerb {
  std::vector<std::string> words, joints, pose;
  std::string output = "plan.yaml";
  double seconds = kUsualExcitation;
  PayloadWords payload;
};

// The description's initial values, and what the options give.
Eigen::VectorXd pose_of(const PlanVerb& verb, const RobotDescription& robot, const Model& model,
                        Diagnostics& diagnostics) {
  Eigen::VectorXd q = model.neutral();
  apply_initial_values(robot, model, q, diagnostics);
  const std::vector<std::string> driven = model.driven_joint_names();
  for (const std::string& word : verb.pose) {
    const std::size_t equals = word.rfind('=');
    const std::string name = word.substr(0, equals);
    if (equals == std::string::npos || std::ranges::find(driven, name) == driven.end()) {
      throw InputError("cli.use", {},
                       fmt::format("'{}' is not JOINT=POSITION of a joint of the robot{}", word,
                                   did_you_mean(name, driven)),
                       "for example --pose \"Revolute 2=90deg\"");
    }
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(model.find_joint(name))];
    q[joint.q] = parse_position(std::string_view(word).substr(equals + 1), word);
    if (q[joint.q] >= joint.lower && q[joint.q] <= joint.upper) continue;
    throw InputError("cli.use", {},
                     fmt::format("{} is outside of the limits of '{}', {:.4g} to {:.4g}", q[joint.q], name,
                                 joint.lower, joint.upper),
                     "give a position within them");
  }
  return q;
}

int run_plan(const PlanVerb& verb) {
  check_output(verb.output);
  DescriptionTarget target = open_target(verb.words);
  const RobotDescription robot = load_target(target).robot;
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  const PlanOptions options{verb.joints, verb.seconds, pose_of(verb, robot, model, diagnostics),
                            payload_of(verb.payload)};
  print_diagnostics(diagnostics);
  const MotionPlan plan = plan_motion(robot, model, options);
  check_plan(plan, model, verb.output);
  deliver(to_yaml(plan), verb.output);
  double seconds = 0;
  for (const PlannedJoint& joint : plan.joints) {
    const auto [least, most] = std::ranges::minmax(joint.path, {}, &Waypoint::position);
    print_line(
        "{}: {:.3g} to {:.3g}, {:.0f} s, {:.0f} % of the speed and {:.0f} % of the effort limit, condition "
        "{:.3g}\n",
        joint.joint, least.position, most.position, joint.path.back().time, 100 * joint.speed,
        100 * joint.effort, joint.condition);
    if (const auto& release = joint.release)
      print_line(
          "  lifted to {:.3g} and released {} times: caught at {:.3g} or {:.3g}, at {:.3g} per s, or after "
          "{:.2g} s\n",
          release->lift, kReleases, release->lower, release->upper, release->speed, release->duration);
    seconds += joint.path.back().time;
  }
  for (const std::string& note : plan.notes) print_note("note: " + note);
  print_line("{}: {} joints, {:.0f} s, for the arm {} {}\n", verb.output, plan.joints.size(), seconds,
             plan.robot, plan.arm);
  print_note(fmt::format("doppel identify record --plan {}", verb.output));
  return 0;
}

}  // namespace

void add_identify_plan(CLI::App& group, int& exit_code) {
  const auto options = std::make_shared<PlanVerb>();
  CLI::App* verb = group.add_subcommand(
      "plan", "A motion that excites the servos within limits and without contact, as a file");
  add_target(*verb, options->words);
  verb->add_option("--joint", options->joints, "Only this joint; repeatable (default: all that are driven)")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("JOINT");
  verb->add_option(
          "--pose", options->pose,
          "Where a joint stands while the others move, in rad or m, or 90deg; repeatable (default: the "
          "description's initial values, or the middle of the range)")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("JOINT=POSITION");
  verb->add_option("--seconds", options->seconds, "Duration of the motion of each joint")
      ->check(CLI::Range(kMinExcitation, 600.0))
      ->capture_default_str();
  add_payload_options(*verb, options->payload, "A known weight that the arm carries in the motions");
  verb->add_option("-o,--output", options->output, "The file; - for stdout")
      ->capture_default_str()
      ->type_name("FILE");
  verb->footer(
      "Each joint moves alone: a slow triangle, steps, and five harmonics of 0.2 Hz whose coefficients have "
      "the\n"
      "least condition number of those tried; then, where the fall is safe, lift and release with the torque "
      "off.\ndoppel identify record --plan FILE plays it, 30 % slow at first.\n"
      "Examples:\n  doppel identify plan omarm_one\n"
      "  doppel identify plan omarm_one --joint \"Revolute 2\" --pose \"Revolute 3=90deg\" -o elbow.yaml\n"
      "See doppel man identification.md");
  verb->callback([options, &exit_code] { exit_code = run_plan(*options); });
}

}  // namespace doppel::app
