// doppel identify record: moves the joints of the running robot one after the other, and records them.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <deque>
#include <filesystem>
#include <optional>

#include "app/print_stderr.h"
#include "app/verbs/arrival.h"
#include "app/verbs/bag_verbs.h"
#include "app/verbs/client_recorder.h"
#include "app/verbs/controllers.h"
#include "app/verbs/hardware_target.h"
#include "app/verbs/identify.h"
#include "app/verbs/identify_motions.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/robot_watch.h"
#include "app/verbs/shell.h"
#include "doppel/base/core/names.h"
#include "doppel/lab/recording/run_recording.h"
#include "doppel/review/identification/excitation.h"
#include "doppel/review/identification/motion_plan.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/scenario/schema/command_kind.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kHeldTime = std::chrono::seconds(2);

struct RecordVerb {
  std::vector<std::string> joints;
  BagOutput output;
  std::string manager;
  std::string plan;
  PayloadWords payload;
  double seconds = kUsualExcitation;
  bool yes = false, release = false;
};

std::vector<Arm> find_arms(Client& twin, const std::string& manager) {
  std::vector<Arm> out;
  for (const auto& controller : list_controllers(twin, manager)) {
    if (controller.state != "active" || command_kind(controller.type) != CommandKind::trajectory) continue;
    const std::vector<std::string>& claimed = command_interfaces_of(controller);
    const std::vector<std::string> joints = joints_of(controller);
    const bool by_position = std::ranges::all_of(joints, [&](const std::string& joint) {
      return std::ranges::find(claimed, joint + "/position") != claimed.end();
    });
    if (by_position) out.push_back({expand_name(controller.name, manager), joints, {}});
  }
  if (out.empty())
    throw ClientError(
        "no active joint_trajectory_controller commands positions, which an identification needs\n  fix: "
        "doppel "
        "control list_controllers shows what is there; doppel control switch_controllers activates one");
  return out;
}

// The controller's commands: measured positions are off by the servos' sag, which would add up.
void find_held(Client& twin, const RobotWatch& robot, Arm& arm) {
  for (const std::string& joint : arm.joints) {
    if (const std::optional<double> present = robot.position(joint)) arm.held[joint] = *present;
  }
  const std::string topic = arm.node + "/controller_state";
  twin.subscribe(topic);
  const auto until = Clock::now() + kHeldTime;
  Client::Received message;
  while (twin.next(message, until)) {
    if (message.topic != topic) continue;
    const auto state = decode<control_msgs::msg::JointTrajectoryControllerState>(message.cdr);
    for (std::size_t i = 0; i < std::min(state.joint_names.size(), state.reference.positions.size()); ++i)
      arm.held[state.joint_names[i]] = state.reference.positions[i];
    break;
  }
  for (const std::string& joint : arm.joints) {
    if (!arm.held.contains(joint))
      throw ClientError(
          fmt::format("joint_states does not contain '{}', which {} moves too", joint, arm.node));
  }
}

// A gentle driver moves slower than commanded, and its speed would be taken for the servo's.
void refuse_gentle(Client& twin, const std::string& topic, const std::vector<std::string>& joints) {
  const auto found = twin.topics().find(topic);
  if (found == twin.topics().end() || found->second.publishers.empty()) return;
  twin.subscribe(topic);
  const auto until = Clock::now() + kHeldTime;
  Client::Received message;
  while (twin.next(message, until)) {
    if (message.topic != topic) continue;
    for (const auto& device : decode<doppel_msgs::msg::Devices>(message.cdr).devices) {
      const bool moves = std::ranges::any_of(device.joints, [&](const auto& joint) {
        return std::ranges::find(joints, std::string(joint.name)) != joints.end();
      });
      if (moves && std::string_view(device.state) == "gentle")
        throw ClientError(fmt::format(
            "'{}' is gentle: it moves at a quarter of the speed, and the recording would show this "
            "limit in place of its servos'\n  fix: doppel hardware check TARGET, and doppel hardware "
            "nudge TARGET for each joint, with the robot ended; or write gentle: never into "
            "hardware.yaml",
            std::string_view(device.name)));
    }
    return;
  }
}

// -- the motions

ExcitationRange range_of(const RobotWatch& robot, const Arm& arm, const std::string& joint) {
  const ModelJoint* described = robot.find(joint);
  if (described == nullptr)
    throw ClientError(
        fmt::format("the robot publishes no description of '{}', so that its limits are not known", joint));
  return {arm.held.at(joint), described->lower, described->upper, described->velocity,
          described->type == JointType::prismatic};
}

void add_parts(std::deque<MotionPart>& parts, const RobotWatch& robot, const Arm& arm,
               const std::string& joint, double seconds) {
  const ExcitationRange range = range_of(robot, arm, joint);
  if (excitation_amplitude(range) <= 0) {
    const double middle = 0.5 * (range.lower + range.upper);
    throw_usage_error(
        fmt::format("'{}' is at {:.3g}, too near to its limits of {:.3g} and {:.3g} {} for a motion", joint,
                    range.position, range.lower, range.upper, range.slides ? "m" : "rad"),
        fmt::format("doppel move \"{}={:.3g}\"", joint, middle));
  }
  parts.push_back({&arm, joint, plan_rehearsal(range), true, {}, {}});
  parts.push_back({&arm, joint, plan_excitation(range, seconds), false, {}, {}});
}

// Slowly to the lift and back; then, for each release, to the lift again.
void add_releases(std::deque<MotionPart>& parts, const MotionPart& moved, const ModelJoint& joint,
                  const PlannedRelease& release, double home) {
  MotionPart slowly{moved.arm, moved.joint, slow_path(joint, home, release.lift), true, {}, {}};
  const double lifted = slowly.path.back().time;
  for (const Waypoint& back : slow_path(joint, release.lift, home))
    slowly.path.push_back({lifted + back.time, back.position});
  parts.push_back(slowly);
  for (int i = 0; i < kReleases; ++i)
    parts.push_back(
        {moved.arm, moved.joint, slow_path(joint, home, release.lift), false, release.lift, release});
  parts.push_back({moved.arm, moved.joint, slow_path(joint, release.lift, home), false, home, {}});
}

constexpr double kPoseSlack = 0.05;  // rad or m, from the plan's pose

// The motions of a plan's file, for the arm that stands in its pose.
std::deque<MotionPart> read_parts(const RobotWatch& robot, const std::vector<Arm>& arms,
                                  const RecordVerb& options) {
  const MotionPlan plan = read_motion_plan(options.plan);
  if (robot.model() == nullptr)
    throw ClientError("the robot publishes no description, so that the plan cannot be checked");
  check_plan(plan, *robot.model(), options.plan);
  std::deque<MotionPart> out;
  std::string away;
  for (const Arm& arm : arms) {
    for (const std::string& joint : arm.joints) {
      const auto pose = plan.pose.find(joint);
      if (pose != plan.pose.end() && std::abs(arm.held.at(joint) - pose->second) > kPoseSlack)
        away += fmt::format(" \"{}={:.4g}\"", joint, pose->second);
      const auto planned = std::ranges::find(plan.joints, joint, &PlannedJoint::joint);
      const bool chosen =
          options.joints.empty() || std::ranges::find(options.joints, joint) != options.joints.end();
      if (planned == plan.joints.end() || !chosen) continue;
      ExcitationRange range = range_of(robot, arm, joint);
      const auto [least, most] = std::ranges::minmax(planned->path, {}, &Waypoint::position);
      range.position = pose->second;
      range.furthest = std::max(most.position - range.position, range.position - least.position);
      out.push_back({&arm, joint, plan_rehearsal(range), true, {}, {}});
      out.push_back({&arm, joint, planned->path, false, {}, {}});
      if (planned->release)
        add_releases(out, out.back(), *robot.find(joint), *planned->release, pose->second);
    }
  }
  if (!away.empty())
    throw_usage_error("the arm does not stand in the pose of the plan", fmt::format("doppel move{}", away));
  if (out.empty())
    throw_usage_error(
        fmt::format("the plan {} moves no joint of an active trajectory controller", options.plan),
        "doppel control list_controllers shows what is active");
  return out;
}

std::deque<MotionPart> plan_parts(const RobotWatch& robot, const std::vector<Arm>& arms,
                                  const RecordVerb& options) {
  std::vector<std::string> names;
  for (const Arm& arm : arms) names.insert(names.end(), arm.joints.begin(), arm.joints.end());
  for (const std::string& joint : options.joints) {
    if (std::ranges::find(names, joint) == names.end())
      throw_usage_error(fmt::format("no active trajectory controller commands the position of '{}'{}", joint,
                                    did_you_mean(joint, names)),
                        fmt::format("one of: {}", fmt::join(names, ", ")));
  }
  std::deque<MotionPart> out;
  for (const Arm& arm : arms) {
    for (const std::string& joint : arm.joints) {
      const bool chosen =
          options.joints.empty() || std::ranges::find(options.joints, joint) != options.joints.end();
      if (chosen) add_parts(out, robot, arm, joint, options.seconds);
    }
  }
  return out;
}

// The weight of the options, else of the plan. Its link is found now, so that a fit reads which one it was.
std::optional<Payload> carried_payload(const RobotWatch& robot, const RecordVerb& verb) {
  std::optional<Payload> out = payload_of(verb.payload);
  if (!verb.plan.empty()) {
    const std::optional<Payload> planned = read_motion_plan(verb.plan).payload;
    if (out && planned && payload_text(*out) != payload_text(*planned))
      throw_usage_error(fmt::format("the plan {} is for a weight of {:.4g} kg", verb.plan, planned->mass),
                        "leave --payload out, or make a plan with it: doppel identify plan --payload");
    if (planned) out = planned;
  }
  if (!out) return out;
  if (robot.model() == nullptr)
    throw ClientError("the robot publishes no description, so that the link of the weight is not known");
  out->link = payload_link(*robot.model(), *out);
  return out;
}

std::string question_of(const std::deque<MotionPart>& parts, const RobotWatch& robot,
                        const std::optional<Payload>& payload) {
  std::string out;
  if (payload)
    out = fmt::format("  with {:.4g} kg at '{}', whose shape is not known: leave room for it\n",
                      payload->mass, payload->link);
  double seconds = 0;
  for (const MotionPart& part : parts) {
    seconds += part.path.back().time;
    if (part.rehearsal || part.target) continue;
    const auto [least, most] = std::ranges::minmax(part.path, {}, &Waypoint::position);
    out += fmt::format("  {}: {:.3g} to {:.3g} {}\n", part.joint, least.position, most.position,
                       joint_unit(*robot.find(part.joint)));
  }
  return fmt::format(
      "These joints move, one after the other, first slowly, at most at {:.0f} % of their speed "
      "limits, for {:.0f} s:\n{}Stay clear of the arm. Move it?",
      100 * kExcitationSpeed, seconds, out);
}

// Empty: nothing is released.
std::string release_question(const std::deque<MotionPart>& parts, const RobotWatch& robot) {
  std::string out;
  std::string last;
  for (const MotionPart& part : parts) {
    if (!part.release || part.joint == last) continue;
    last = part.joint;
    const std::string unit(joint_unit(*robot.find(part.joint)));
    out += fmt::format(
        "  {}: at {:.3g} {}, {} times for at most {:.2g} s; it falls, and is caught at {:.3g} or {:.3g} "
        "{}\n",
        part.joint, part.release->lift, unit, kReleases, part.release->duration, part.release->lower,
        part.release->upper, unit);
  }
  if (out.empty()) return out;
  return fmt::format(
      "Then the torque of one joint at a time goes off, while the others hold:\n{}If this program or its "
      "connection "
      "ends, the driver catches the joint; if the driver ends, the joint falls.\nRelease them?",
      out);
}

// -- the recording

TopicSelection topics_of(const std::vector<Arm>& arms, const std::string& manager) {
  TopicSelection out;
  for (const char* name : {"joint_states", "robot_description", "doppel/hardware", "doppel/joint_loads"})
    out.topics.push_back(expand_name(name, manager));
  for (const Arm& arm : arms) out.topics.push_back(arm.node + "/controller_state");
  return out;
}

// The reason of an early end; empty: there is none.
std::string run_motions(ClientRecorder& recorder, Motions& motions, bool& interrupted) {
  std::string failure;
  try {
    recorder.run();
  } catch (const Interrupted&) {
    interrupted = true;
  } catch (const ClientError& error) {
    failure = error.what();
  }
  Shell::clear_interrupt();
  try {
    motions.cancel();
  } catch (const ClientError& error) {
    failure += (failure.empty() ? "" : "; ") + std::string(error.what());
  }
  return failure.empty() ? motions.problem() : failure;
}

int report_recording(const BagWriter& writer, const std::string& failure, bool interrupted) {
  if (interrupted) print_note("interrupted; the arm was stopped where it was");
  if (!failure.empty()) print_note("error: " + failure);
  if (writer.metadata().messages == 0) {
    std::filesystem::remove_all(writer.folder());
    print_note("nothing was recorded");
  } else {
    print_line("{}: {} messages, {}\n", writer.folder().string(), writer.metadata().messages,
               size_text(writer.size()));
    if (failure.empty() && !interrupted)
      print_note(fmt::format("doppel identify fit TARGET --recording {}", writer.folder().string()));
  }
  if (interrupted) return kInterrupted;
  return failure.empty() ? 0 : 1;
}

ClientRecorderOptions motion_recording(const RecordVerb& verb, const std::vector<Arm>& arms,
                                       const std::string& manager, const std::optional<Payload>& payload) {
  ClientRecorderOptions out;
  out.topics = topics_of(arms, manager);
  out.bag = writer_options(verb.output);
  if (payload) out.bag.custom = payload_data(*payload);
  if (out.bag.folder.empty()) out.bag.folder = dated_bag_folder(".").lexically_normal();
  out.paused = true;
  if (std::filesystem::exists(out.bag.folder))
    throw_usage_error(fmt::format("'{}' exists already", out.bag.folder.string()), "name another folder");
  return out;
}

int record_motions(Shell& shell, const RecordVerb& verb) {
  Client& twin = shell.twin();
  const std::string manager = find_manager(twin, verb.manager);
  const RobotWatch robot(twin, manager);
  if (robot.is_stopped())
    throw ClientError("the emergency stop is on, so nothing moves\n  fix: doppel stop --reset");
  std::vector<Arm> arms = find_arms(twin, manager);
  for (Arm& arm : arms) find_held(twin, robot, arm);
  std::deque<MotionPart> parts =
      verb.plan.empty() ? plan_parts(robot, arms, verb) : read_parts(robot, arms, verb);
  std::vector<std::string> moved;
  for (const MotionPart& part : parts) moved.push_back(part.joint);
  refuse_gentle(twin, expand_name("doppel/hardware", manager), moved);
  const std::optional<Payload> payload = carried_payload(robot, verb);
  ClientRecorderOptions options = motion_recording(verb, arms, manager, payload);
  if (!confirmed(question_of(parts, robot, payload), verb.yes)) return 1;
  const std::string question = release_question(parts, robot);
  // A joint that falls is a question of its own, so that a script of before does not let one fall.
  if (!question.empty() && verb.yes && !verb.release)
    print_stderr("note: lift and release are omitted: --release plays them\n");
  if (!question.empty() && !verb.release && (verb.yes || !confirmed(question, false)))
    std::erase_if(parts, [](const MotionPart& part) { return part.target.has_value(); });
  Motions motions(twin, robot, expand_name("doppel/hardware", manager),
                  expand_name("doppel/hardware/release_joint", manager), std::move(parts));
  for (const std::string& topic : options.topics.topics) twin.unsubscribe(topic);  // the recorder's now
  ClientRecorder* running = nullptr;
  options.look = [&] { motions.look(*running); };
  options.take = [&](const Client::Received& message) { motions.take(message); };
  ClientRecorder recorder(twin, std::move(options));
  running = &recorder;
  Shell::catch_interrupts();
  bool interrupted = false;
  const std::string failure = run_motions(recorder, motions, interrupted);
  recorder.close();
  if (isatty(STDERR_FILENO) != 0) print_note("");
  return report_recording(recorder.writer(), failure, interrupted);
}

}  // namespace

void add_identify_record(CLI::App& group, int& exit_code) {
  add_verb<RecordVerb>(
      group, "record", "Move the joints of the running robot one after the other, and record them as a bag",
      "doppel identify record --plan plan.yaml -o motions\n  doppel identify record -o motions\n  doppel "
      "identify record --joint \"Revolute 2\" --seconds 30 "
      "--yes\n  doppel identify record --payload 200g@0,0,0.05 -o loaded\n"
      "Each joint moves about its present position, first slowly over the whole range; Ctrl-C stops the arm, "
      "and "
      "keeps the file.",
      exit_code,
      [](CLI::App& verb, RecordVerb& options) {
        verb.add_option("--joint", options.joints,
                        "Only this joint; repeatable (default: all of the trajectory controllers)")
            ->take_all()
            ->allow_extra_args(false)
            ->type_name("JOINT");
        verb.add_option("--plan", options.plan, "Play this plan: doppel identify plan")->type_name("FILE");
        add_payload_options(verb, options.payload, "A known weight that the arm carries, for the fit");
        add_output_options(verb, options.output, false);
        verb.add_option("--seconds", options.seconds, "Duration of the recorded motion of each joint")
            ->check(CLI::Range(kMinExcitation, 600.0))
            ->capture_default_str();
        declare_manager(verb, options.manager);
        verb.add_flag("-y,--yes", options.yes,
                      "Answer the question with yes, and leave lift and release out");
        verb.add_flag("--release", options.release, "Play lift and release of the plan without a question");
      },
      record_motions);
}

}  // namespace doppel::app
