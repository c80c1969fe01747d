#include "doppel/validation/motions/running_gates.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/validation/motions/detail/failure_recorder.h"
#include "doppel/validation/motions/machine_run.h"
#include "doppel/validation/statics/audit_gates.h"

namespace doppel {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kListen = 2.0;                      // s, to transforms
constexpr double kMaxGap = 2.0;                      // periods
constexpr double kHold = 10.0, kSettle = 1.0;        // s
constexpr double kSag = 0.05, kSlideSag = 0.005;     // rad, m: from the start pose
constexpr double kDrift = 1e-3, kSlideDrift = 1e-4;  // rad, m
constexpr double kTry = 3.0;                         // s, for the first motion of a joint
constexpr double kMaxStart = 2.0;                    // s of wall-clock time, until the first motion
constexpr double kMotion = 1e-3, kStepAside = 0.05;  // rad or m
constexpr double kDrive = 0.1;                       // m/s, of a base

constexpr double kHoldSteps[] = {0.5e-3, 1e-3, 2e-3};  // s

std::string step_text(double step) {
  return fmt::format("{:.3g} ms", 1e3 * step);
}

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// The transforms that were published: for each child its parent and the times.
struct Transforms {
  std::map<std::string, std::set<std::string>> parents;
  std::map<std::string, std::vector<double>> times;  // of those that are not static
};

Transforms listen(MachineRun& machine) {
  constexpr std::size_t kRing = std::size_t{16} << 20;
  Transforms out;
  Bus& bus = machine.twin().bus();
  const auto edge = bus.attach("/doppel_validate_tf", {.ring_bytes = kRing});
  std::map<TopicId, bool> is_static;
  for (const TopicInfo& topic : bus.topics()) {
    // Some controllers of bases have a topic of their own beside these.
    const bool is_tf = topic.name.ends_with("/tf") || topic.name.ends_with("/tf_static");
    if (!is_tf || topic.publishers.empty()) continue;
    is_static[topic.id] = topic.latched;
    edge->subscribe(topic.id);
  }
  machine.run(kListen, [&] {
    Edge::Incoming incoming;
    tf2_msgs::msg::TFMessage message;
    while (edge->next(incoming)) {
      if (!from_cdr(incoming.cdr, message)) continue;
      for (const auto& transform : message.transforms) {
        out.parents[transform.child_frame_id].insert(transform.header.frame_id);
        if (!is_static[incoming.topic])
          out.times[transform.child_frame_id].push_back(to_seconds(incoming.stamp));
      }
    }
  });
  return out;
}

// The largest gap of a frame in its usual periods.
double largest_gap(std::vector<double> times) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < times.size(); ++i) gaps.push_back(times[i] - times[i - 1]);
  if (gaps.empty()) return kInfinity;
  std::ranges::sort(gaps);
  const double usual = gaps[gaps.size() / 2];
  return usual > 0 ? gaps.back() / usual : 1;
}

// Joints that hardware can command and no active controller has.
std::vector<std::string> idle_joints(const ControllerManager& manager, const RobotDescription& robot) {
  std::map<std::string, bool> claimed;
  for (const InterfaceView& interface : manager.command_interfaces()) {
    const std::string joint = interface.full_name.substr(0, interface.full_name.rfind('/'));
    if (robot.find_joint(joint) == nullptr) continue;  // a reference of a chainable controller
    bool& has = claimed[joint];
    has = has || !interface.claimed_by.empty();
  }
  std::vector<std::string> out;
  for (const auto& [joint, has] : claimed) {
    if (!has) out.push_back(joint);
  }
  return out;
}

// The largest drift of a joint from its position after a second.
struct Drift {
  double largest = 0;  // of the limit
  std::string text, joint;
};

Drift drift_of(const MachineRun& machine, const std::vector<double>& settled) {
  Drift out;
  for (std::size_t i = 0; i < machine.joints().size(); ++i) {
    const int joint = machine.joints()[i];
    const bool slides = machine.slides(joint);
    const double moved = std::abs(machine.position(joint) - settled[i]);
    const double share = moved / (slides ? kSlideDrift : kDrift);
    if (share < out.largest) continue;
    out = {share, position_text(moved, slides), machine.joint(joint).name};
  }
  return out;
}

// The same failure of holding at several steps is one statement.
struct HoldingFailure {
  std::string subject, kind, message, fix;
  double size = 0;  // the largest counts
  std::vector<std::string> steps = {};
};

struct Holding {
  std::vector<HoldingFailure> failures;
  double slowest = kInfinity;  // real-time factor
  double drift = 0;            // of the limit

  void fail(const std::string& step, HoldingFailure failure) {
    const auto same = std::ranges::find_if(failures, [&](const HoldingFailure& one) {
      return one.subject == failure.subject && one.kind == failure.kind;
    });
    if (same == failures.end()) {
      failure.steps = {step};
      failures.push_back(std::move(failure));
      return;
    }
    same->steps.push_back(step);
    if (failure.size <= same->size) return;
    same->size = failure.size;
    same->message = failure.message;
  }
};

// A joint that is not where it started does not hold.
void judge_sag(const MachineRun& machine, int joint, double start, const std::string& step, Holding& out) {
  const bool slides = machine.slides(joint);
  const double moved = std::abs(machine.position(joint) - start);
  const DriveMode mode = machine.drive(joint);
  if (mode != DriveMode::position || moved <= (slides ? kSlideSag : kSag)) return;
  out.fail(step, {machine.joint(joint).name, "sag",
                  fmt::format("gives way by {} within {:.0f} s of the start (limit {})",
                              position_text(moved, slides), kSettle,
                              position_text(slides ? kSlideSag : kSag, slides)),
                  "its effort limit, or the stiffness of its servo", moved});
}

void judge_held(MachineRun& machine, const std::vector<double>& settled, const std::string& step,
                CheckResult& result, Holding& out) {
  const Drift drift = drift_of(machine, settled);
  result.metrics.push_back({"drift", "step " + step, drift.largest, "of the limit", 1.0});
  out.drift = std::max(out.drift, drift.largest);
  if (drift.largest > 1)
    out.fail(step, {drift.joint, "drift",
                    fmt::format("drifts by {} while it is held (limit 1 mrad, 0.1 mm)", drift.text),
                    "the effort limit of the joint, or gains", drift.largest});
  if (machine.twin().engine().dropped_contacts() > 0)
    out.fail(step, {"", "contacts", "the engine had no room for all contacts", "simpler collision shapes"});
  for (const OscillationReport& oscillation : machine.twin().robot().oscillations())
    out.fail(step, {oscillation.joint, "oscillation", oscillation.message, "smaller gains, or more damping"});
}

void hold_at(const CheckContext& context, double step_size, double part, CheckResult& result, Holding& out) {
  MachineOptions options;
  options.step = from_seconds(step_size);
  MachineRun machine(context, options);
  const std::string step = step_text(step_size);
  const auto begin = Clock::now();
  std::vector<double> start;
  for (const int joint : machine.joints()) start.push_back(machine.position(joint));
  bool whole = machine.run(kSettle);
  std::vector<double> settled;
  for (std::size_t i = 0; i < machine.joints().size(); ++i) {
    settled.push_back(machine.position(machine.joints()[i]));
    judge_sag(machine, machine.joints()[i], start[i], step, out);
  }
  constexpr int kParts = 9;
  for (int i = 0; i < kParts && whole; ++i) {
    whole = machine.run((kHold - kSettle) / kParts);
    context.report(part + static_cast<double>(i) / (3.0 * kParts));
  }
  const double factor = to_seconds(machine.twin().now()) / seconds_since(begin);
  out.slowest = std::min(out.slowest, factor);
  result.metrics.push_back(
      {"real-time factor", "step " + step, factor, "", 1.0, Metric::Better::higher, true});
  if (whole) return judge_held(machine, settled, step, result, out);
  out.fail(step,
           {"", "divergence",
            fmt::format("the physics diverges after {:.3f} s of holding", to_seconds(machine.twin().now())),
            "masses and inertias (G04), overlapping shapes (T3), or gains"});
}

// Each failure at the first step at which it is seen, holding once more; those of one step share a recording.
void record_failures(const CheckContext& context, const Holding& holding, CheckResult& out) {
  FailureRecorder recorder(context, out);
  std::map<std::string, std::string> files;  // by step
  for (std::size_t i = 0; i < holding.failures.size(); ++i) {
    const std::string& step = holding.failures[i].steps.front();
    const auto [file, is_new] = files.try_emplace(step);
    const double* const size = std::ranges::find(kHoldSteps, step, [](double one) { return step_text(one); });
    if (is_new && size != std::end(kHoldSteps)) {
      recorder.record(out.items[i], "step " + step, [&] {
        MachineRun machine(context, {.step = from_seconds(*size)});
        machine.start_recording();
        machine.run(kHold);
        return machine.finish_recording();
      });
      file->second = out.items[i].recording;
    }
    out.items[i].recording = file->second;
  }
}

// The way from a command to the first motion: of the first joint that follows one, else of a base.
struct FirstMotion {
  std::optional<double> after;       // s of simulated time after its command
  std::vector<std::string> waiting;  // joints that did not follow theirs
};

FirstMotion first_motion(MachineRun& machine) {
  FirstMotion out;
  for (const int joint : machine.joints()) {
    for (const JointWay& way : machine.ways(joint)) {
      if (way.interface != "position" || way.kind == JointWay::Kind::trajectory_action) continue;
      const double start = machine.position(joint);
      const double aside = start + kStepAside <= machine.joint(joint).upper ? kStepAside : -kStepAside;
      const Time commanded = machine.twin().now();
      machine.send(way, start + aside, 0.1);
      machine.run(kTry, [&] {
        if (!out.after && std::abs(machine.position(joint) - start) > kMotion)
          out.after = to_seconds(machine.twin().now() - commanded);
      });
      if (out.after) return out;
      out.waiting.push_back(machine.joint(joint).name);
      break;
    }
  }
  const Time commanded = machine.twin().now();
  machine.drive_base(kDrive, [&](double way) {
    if (!out.after && way > kMotion) out.after = to_seconds(machine.twin().now() - commanded);
  });
  return out;
}

}  // namespace

CheckResult check_transforms(const CheckContext& context) {
  CheckResult out = begin_result("G08");
  MachineRun machine(context, {});
  const Transforms transforms = listen(machine);
  const std::string prefix =
      machine.twin().robot().name_space().empty() ? "" : machine.twin().robot().name_space() + "/";
  double worst = 1;
  const std::vector<Link>& links = context.subject.description().links;
  std::vector<std::string> roots;
  for (const Link& link : links) {
    const auto parents = transforms.parents.find(prefix + link.name);
    if (parents == transforms.parents.end()) {
      roots.push_back(link.name);
    } else if (parents->second.size() > 1) {
      out.fail(fmt::format("link '{}'", link.name),
               fmt::format("has {} parents: {}", parents->second.size(), fmt::join(parents->second, ", ")),
               "two nodes publish its transform", link.source);
    }
    const auto times = transforms.times.find(prefix + link.name);
    if (times == transforms.times.end()) continue;
    const double gap = largest_gap(times->second);
    worst = std::max(worst, gap);
    if (gap > kMaxGap)
      out.fail(fmt::format("link '{}'", link.name),
               fmt::format("its transform has a gap of {:.1f} periods (limit 2)", gap), "", link.source);
  }
  const std::string root = context.subject.model->links.front().name;
  for (const std::string& link : roots) {
    if (link == root) continue;
    const Link* const source = context.subject.description().find_link(link);
    out.fail(fmt::format("link '{}'", link),
             "has no transform: no controller or broadcaster publishes the state of a joint above it",
             "a joint_state_broadcaster, and state interfaces of the joint in <ros2_control>",
             source->source);
  }
  out.summary = fmt::format("{} links, largest gap {:.2g} periods (limit 2)", links.size(), worst);
  return out;
}

CheckResult check_controllers(const CheckContext& context) {
  CheckResult out = begin_result("G09");
  add_control_findings(context, out);
  MachineRun machine(context, {});
  const ControllerManager& manager = machine.twin().robot().controller_manager();
  std::size_t active = 0;
  const std::vector<ControllerView> controllers = manager.controllers();
  for (const ControllerView& view : controllers) {
    active += view.state == ControllerState::active ? 1 : 0;
    if (view.state == ControllerState::unconfigured)
      out.fail(view.name, "is loaded and not configured", "doppel control list, and the log of doppel up");
  }
  for (const HardwareView& view : manager.hardware()) {
    if (view.state != HardwareState::active)
      out.fail(view.name,
               "the hardware component is not active" + (view.fault.empty() ? "" : ": " + view.fault));
  }
  for (const std::string& joint : idle_joints(manager, context.subject.description())) {
    const Joint* const source = context.subject.description().find_joint(joint);
    out.add({joint, Verdict::failed, "can be commanded, and no active controller has it",
             "add it to a controller of the YAML file, or remove its command interface",
             source != nullptr ? source->source : SourceLocation{}});
  }
  for (const LogLine& line : machine.take_lines()) {
    if (line.severity == Severity::error) out.fail(line.origin, line.text);
  }
  if (controllers.empty())
    out.fail("", "no controller is declared", "doppel new writes a file of controllers");
  const auto failures = std::ranges::count(out.items, Verdict::failed, &CheckItem::verdict);
  out.summary = fmt::format("{} of {} controllers active", active, controllers.size());
  if (failures > 0) out.summary += fmt::format(", {} {}", failures, failures == 1 ? "failure" : "failures");
  return out;
}

CheckResult check_start(const CheckContext& context) {
  CheckResult out = begin_result("G10");
  const auto begin = Clock::now();
  MachineRun machine(context, {});
  const double ready = seconds_since(begin);
  const FirstMotion motion = first_motion(machine);
  out.metrics.push_back({"ready", "", ready, "s", std::nullopt, Metric::Better::lower, true});
  for (const std::string& joint : motion.waiting)
    out.fail(joint, fmt::format("does not move within {:.0f} s of a command", kTry),
             "its controller, its effort limit, or the update_rate of the controller manager");
  if (!motion.after && motion.waiting.empty()) {
    out.add({"", Verdict::not_judged,
             "no joint has a position command, and no base a velocity command, that could be tried"});
    out.summary = "controllers hold, and nothing could be moved";
    return out;
  }
  out.summary = motion.waiting.empty()
                    ? "the first motion comes in time"
                    : fmt::format("{} of the joints that were tried did not move", motion.waiting.size());
  if (!motion.after) return out;
  // A twin is started in real time, and simulated time counts from there on.
  const double moved = ready + *motion.after;
  out.metrics.push_back({"first motion", "", moved, "s", kMaxStart, Metric::Better::lower, true});
  if (moved > kMaxStart) {
    out.summary = fmt::format("the first motion comes late (limit {:.3g} s)", kMaxStart);
    out.fail("", fmt::format("the first motion comes after {:.2f} s (limit {:.3g} s)", moved, kMaxStart),
             ready > *motion.after ? "smaller meshes" : "delays of the controller");
  }
  return out;
}

CheckResult check_holding(const CheckContext& context) {
  CheckResult out = begin_result("G11");
  Holding holding;
  double part = 0;
  for (const double step : kHoldSteps) {
    hold_at(context, step, part, out, holding);
    part += 1.0 / 3;
  }
  for (const HoldingFailure& one : holding.failures) {
    const std::string steps =
        one.steps.size() == 3 ? "at every step" : fmt::format("at a step of {}", fmt::join(one.steps, ", "));
    out.fail(one.subject, fmt::format("{}; {}", one.message, steps), one.fix);
  }
  record_failures(context, holding, out);
  if (holding.slowest < 1)
    out.fail("", "the simulation is slower than real time", "simpler collision shapes, or a larger step");
  std::set<std::string> joints;
  for (const HoldingFailure& one : holding.failures) {
    if (!one.subject.empty()) joints.insert(one.subject);
  }
  out.summary = joints.empty() ? fmt::format("10 s at three steps, drift {:.2g} of the limit", holding.drift)
                               : fmt::format("{} {} not hold still", joints.size(),
                                             joints.size() == 1 ? "joint does" : "joints do");
  return out;
}

}  // namespace doppel
