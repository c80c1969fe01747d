#include "doppel/validation/motions/drop_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "doppel/lab/recording/motion_recording.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/robot/collision/lowest_point.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/validation/motions/detail/failure_recorder.h"
#include "doppel/validation/motions/detail/fall_recording.h"

namespace doppel {
namespace {

constexpr double kHeight = 0.01;                                              // m, of the fall
constexpr double kRestSpeed = 0.01, kRestTurn = 0.05;                         // m/s, rad/s
constexpr double kRestTime = 0.25, kDuration = 3.0, kReleaseDuration = 10.0;  // s
constexpr double kLook = 5e-3;  // s, between two looks at heights
constexpr double kMicro = 1e-6;

struct Fall {
  std::string name;  // of the fall, in messages
  bool diverged = false;
  double step = 0, diverged_at = 0;     // s
  std::optional<double> settled;        // s
  double final_depth = 0, deepest = 0;  // m, in the ground
  double gain = 0;                      // J above the energy at the start
  double energy = 0;                    // J at the start above the end, or of the fall
  double rebound = 0;                   // m
  double com_height = 0;                // m at the end
  std::string fastest_link, deepest_link;
  PlotPanel energies;
};

// The robot without the link "world", which holds it.
std::optional<RobotDescription> without_world(const RobotDescription& robot) {
  RobotDescription out = robot;
  if (robot.links.empty()) return std::nullopt;
  const bool has_world =
      std::ranges::any_of(robot.links, [](const Link& link) { return link.name == "world"; });
  if (!has_world) return out;
  std::erase_if(out.links, [](const Link& link) { return link.name == "world"; });
  const auto removed = std::erase_if(out.joints, [](const Joint& joint) { return joint.parent == "world"; });
  if (removed != 1) return std::nullopt;
  return out;
}

struct DropWorld {
  std::shared_ptr<const RobotDescription> description;
  std::shared_ptr<const Model> model;
  ModelInstance instance;
};

std::optional<DropWorld> drop_world(const Subject& subject) {
  if (subject.robot().base() == BaseKind::floating)
    return DropWorld{subject.robot().instance().description, subject.robot().shared_model(),
                     subject.robot().instance()};
  auto robot = without_world(subject.description());
  if (!robot) return std::nullopt;
  DropWorld out;
  Diagnostics none;
  out.description = std::make_shared<const RobotDescription>(std::move(*robot));
  out.model = std::make_shared<const Model>(compile_model(*out.description, BaseKind::floating, none));
  CollisionMeshes meshes;
  InstanceOptions options;
  options.set_on_ground = true;
  out.instance = make_instance(out.description, out.model, options, meshes, none);
  return out;
}

double lowest_of(const Instance& robot) {
  return lowest_point(robot.made_of().shapes,
                      [&](std::size_t link) { return robot.link_pose(static_cast<int>(link)); });
}

double com_height(const Instance& robot) {
  double mass = 0, moment = 0;
  const Model& model = robot.model();
  for (std::size_t link = 0; link < model.links.size(); ++link) {
    if (!model.links[link].inertia) continue;
    const MassProperties& about = *model.links[link].inertia;
    mass += about.mass;
    moment += about.mass * (robot.link_pose(static_cast<int>(link)) * about.com).z();
  }
  return mass > 0 ? moment / mass : 0;
}

class FallRun {
 public:
  FallRun(const Subject& subject, const ModelInstance& instance, double step, std::string name)
      : name_(std::move(name)) {
    WorldSettings world = subject.compiled->engine->world().settings();
    world.step = from_seconds(step);
    Diagnostics none;
    engine_ = compile_world(subject.scenario.engine, world, {instance}, none)->make_engine();
    out_.step = step;
    out_.name = name_;
    out_.energies.title = fmt::format("{}, step {:.3g} ms", name_, 1e3 * step);
    out_.energies.unit = "J";
    out_.energies.curves.push_back({"mechanical energy", {}, {}});
  }

  [[nodiscard]] Instance robot() { return engine_->instance(0); }

  // Before run(), once the robot is at its start.
  void start_recording() { recording_ = std::make_unique<FallRecording>(*engine_); }
  [[nodiscard]] RecordedMotion finish_recording() { return recording_->finish(); }

  Fall run(double duration) {
    const double start = energy();
    double lowest = kInfinity;  // after the first contact
    double quiet_since = 0, next_look = 0;
    bool touched = false;
    double time = 0;
    while (time < duration) {
      time = to_seconds(engine_->time());
      engine_->step();
      if (recording_ != nullptr) recording_->take();
      if (engine_->diverged()) {
        out_.diverged = true;
        out_.diverged_at = time + out_.step;
        break;
      }
      const double present = energy();
      out_.energies.curves.front().times.push_back(time);
      out_.energies.curves.front().values.push_back(present);
      out_.gain = std::max(out_.gain, present - start);
      look_at_contacts(touched);
      if (!is_quiet()) quiet_since = time;
      if (!out_.settled && time - quiet_since >= kRestTime) out_.settled = quiet_since;
      if (time < next_look) continue;
      next_look = time + kLook;
      const double height = lowest_of(robot());
      if (touched) {
        out_.rebound = std::max(out_.rebound, height - std::min(lowest, height));
        lowest = std::min(lowest, height);
      }
    }
    // A robot that moves again was not at rest.
    if (out_.settled && quiet_since > *out_.settled + kMicro) out_.settled.reset();
    if (!out_.diverged) {
      out_.com_height = com_height(robot());
      out_.final_depth = depth_;
      out_.energy = std::max(start - energy(), 0.0);
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] double energy() const { return engine_->kinetic_energy() + engine_->potential_energy(); }

  bool is_quiet() {
    const Instance& about = engine_->instance(0);
    double fastest = 1;  // of the speeds at rest
    for (std::size_t link = 0; link < about.model().links.size(); ++link) {
      if (!about.model().links[link].inertia) continue;
      const FrameVelocity velocity = about.link_velocity(static_cast<int>(link));
      const double share =
          std::max(velocity.linear_W.norm() / kRestSpeed, velocity.angular_W.norm() / kRestTurn);
      if (share <= fastest) continue;
      fastest = share;
      out_.fastest_link = about.model().links[link].name;
    }
    return fastest <= 1;
  }

  void look_at_contacts(bool& touched) {
    engine_->contacts(contacts_);
    depth_ = 0;
    for (const Contact& contact : contacts_) {
      if (!contact.a.is_ground() && !contact.b.is_ground()) continue;
      touched = true;
      depth_ = std::max(depth_, contact.depth);
      if (contact.depth <= out_.deepest) continue;
      out_.deepest = contact.depth;
      out_.deepest_link = engine_->world().name_of(contact.a.is_ground() ? contact.b : contact.a);
    }
  }

  std::string name_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<FallRecording> recording_;
  std::vector<Contact> contacts_;
  double depth_ = 0;
  Fall out_;
};

class DropJudge {
 public:
  DropJudge(const CheckContext& context, CheckResult& out)
      : context_(context), limits_(context.suite.drop), out_(out), recorder_(context, out) {}

  void run() {
    constexpr double kSteps[] = {0.5e-3, 1e-3, 2e-3};
    const std::optional<DropWorld> world = drop_world(context_.subject);
    if (world) {
      std::vector<Fall> falls;
      for (const double step : kSteps) {
        const std::size_t before = out_.items.size();
        falls.push_back(fall(*world, step));
        judge_fall(falls.back(), limits_.settling);
        record(before, fmt::format("step {:.3g} ms", 1e3 * step), [&] {
          FallRun run = fall_run(*world, step);
          run.start_recording();
          run.run(kDuration);
          return run.finish_recording();
        });
        context_.report(static_cast<double>(falls.size()) / 4);
      }
      compare(falls);
      if (out_.verdict == Verdict::failed) search_step(*world);
      summarise(falls);
    } else {
      out_.notes.push_back(
          "the robot is fixed to the world by several joints, so that it cannot fall as a whole");
    }
    if (context_.subject.robot().base() == BaseKind::fixed) release();
  }

 private:
  FallRun fall_run(const DropWorld& world, double step) const {
    FallRun run(context_.subject, world.instance, step, "fall of the whole robot");
    Instance robot = run.robot();
    Pose X_WB = robot.base_pose();
    X_WB.translation().z() += kHeight + std::min(0.0, -lowest_of(robot));
    robot.place(X_WB);
    return run;
  }
  Fall fall(const DropWorld& world, double step) const { return fall_run(world, step).run(kDuration); }

  // The first failure since the items were `before`; all of them are of one fall.
  void record(std::size_t before, const std::string& part, const std::function<RecordedMotion()>& motion) {
    std::string file;
    for (std::size_t i = before; i < out_.items.size(); ++i) {
      CheckItem& item = out_.items[i];
      if (item.verdict != Verdict::failed) continue;
      if (file.empty()) recorder_.record(item, part, motion);
      if (file.empty()) file = item.recording;
      item.recording = file;
    }
  }

  // An arm that stays bolted to the world falls onto its stops or onto the ground.
  void release() {
    const auto make = [&] {
      return FallRun(context_.subject, context_.subject.robot().instance(), 1e-3,
                     "release of the bolted arm");
    };
    const std::size_t before = out_.items.size();
    const Fall fall = make().run(kReleaseDuration);
    judge_release(fall);
    record(before, "release", [&] {
      FallRun run = make();
      run.start_recording();
      run.run(kReleaseDuration);
      return run.finish_recording();
    });
  }

  void judge_release(const Fall& fall) {
    if (fall.diverged) {
      out_.fail(fall.name, divergence_text(fall), kInertiaFix);
      return;
    }
    judge_energy(fall);
    if (!fall.settled) {
      out_.add({fall.name, Verdict::warned,
                fmt::format("it still moves after {:.0f} s: '{}'", kReleaseDuration, fall.fastest_link),
                "joint damping or friction (<dynamics>)"});
    }
  }

  [[nodiscard]] std::string subject_of(const Fall& fall) const {
    return fmt::format("{}, step {:.3g} ms", fall.name, 1e3 * fall.step);
  }

  [[nodiscard]] bool is_larger_step(const Fall& fall) const {
    constexpr double kRounding = 1.001;
    return fall.step > kRounding * to_seconds(context_.subject.compiled->world.step);
  }

  // At a larger step than that of the machine's own world a failure is that of the step.
  void add(const Fall& fall, const std::string& message, const std::string& fix, const std::string& link) {
    if (is_larger_step(fall)) {
      out_.notes.push_back(fmt::format("at a step of {:.3g} ms {}", 1e3 * fall.step, message));
      return;
    }
    CheckItem item{subject_of(fall), Verdict::failed, message, fix};
    if (const Link* const source = context_.subject.description().find_link(link))
      item.where = source->source;
    item.curves.push_back(fall.energies);
    out_.add(std::move(item));
  }

  void judge_energy(const Fall& fall) {
    constexpr double kSmallest = 1e-6;  // J
    const double room = std::max(limits_.energy * fall.energy, kSmallest);
    if (fall.gain > room) {
      add(fall,
          fmt::format(
              "it gains {:.3g} J, {:.1f} % of the energy of its fall (limit {:.3g} %): '{}' moves the most",
              fall.gain, 100 * fall.gain / std::max(fall.energy, kSmallest), 100 * limits_.energy,
              fall.fastest_link),
          kInertiaFix, fall.fastest_link);
    }
  }

  void judge_fall(const Fall& fall, double settling) {
    if (fall.diverged) {
      add(fall, divergence_text(fall), kInertiaFix, fall.fastest_link);
      return;
    }
    judge_energy(fall);
    if (!fall.settled || *fall.settled > settling) {
      add(fall,
          fall.settled ? fmt::format("it settles after {:.2f} s (limit {:.3g} s): '{}' moves the longest",
                                     *fall.settled, settling, fall.fastest_link)
                       : fmt::format("it does not settle within {:.0f} s: '{}' still moves", kDuration,
                                     fall.fastest_link),
          undamped_text(), fall.fastest_link);
    }
    if (fall.final_depth > limits_.penetration || fall.deepest > limits_.deepest) {
      add(fall,
          fmt::format("'{}' sinks {:.2f} mm into the ground, {:.2f} mm at rest (limits {:.3g} and {:.3g} mm)",
                      fall.deepest_link, 1e3 * fall.deepest, 1e3 * fall.final_depth, 1e3 * limits_.deepest,
                      1e3 * limits_.penetration),
          "the mass of the link, or a collision shape that starts below the ground", fall.deepest_link);
    }
    if (fall.rebound > limits_.rebound * kHeight) judge_rebound(fall);
  }

  // Contacts without a restitution bounce as the engine makes them; what flies higher than it fell has gained
  // energy.
  void judge_rebound(const Fall& fall) {
    const std::string message =
        fmt::format("it bounces {:.2f} mm high, {:.0f} % of its fall (limit {:.3g} %)", 1e3 * fall.rebound,
                    100 * fall.rebound / kHeight, 100 * limits_.rebound);
    if (fall.rebound > kHeight) {
      add(fall, message, "a mass that is too small for its inertia, or shapes that overlap where it starts",
          fall.fastest_link);
    } else if (!is_larger_step(fall)) {
      out_.add(
          {subject_of(fall), Verdict::warned, message, "the restitution of the contact, or a smaller step"});
    }
  }

  void compare(const std::vector<Fall>& falls) {
    double low = kInfinity, high = -kInfinity;
    for (const Fall& fall : falls) {
      if (fall.diverged) return;
      low = std::min(low, fall.com_height);
      high = std::max(high, fall.com_height);
    }
    out_.metrics.push_back({"spread", "", high - low, "m", limits_.spread});
    if (high - low <= limits_.spread) return;
    out_.fail("",
              fmt::format("the runs at different steps end with their centres of mass {:.1f} mm apart in "
                          "height (limit {:.3g} mm)",
                          1e3 * (high - low), 1e3 * limits_.spread),
              "a smaller step of the physics, or damping of the joints");
  }

  [[nodiscard]] static std::string divergence_text(const Fall& fall) {
    return fmt::format("the physics diverges after {:.4f} s{}", fall.diverged_at,
                       fall.fastest_link.empty() ? ", before anything has moved"
                                                 : fmt::format("; '{}' was the fastest", fall.fastest_link));
  }

  // The cause of endless motion that a description has most often.
  [[nodiscard]] std::string undamped_text() const {
    std::vector<std::string> names;
    for (const ModelJoint& joint : context_.subject.model->joints) {
      if (joint.scalar() && joint.damping == 0 && joint.friction == 0) names.push_back(joint.name);
    }
    if (names.empty())
      return "more damping or friction of the joints (<dynamics>), or collision shapes that lie flat";
    return fmt::format("<dynamics damping=... friction=...>: {} of the joints have neither, for example '{}'",
                       names.size(), names.front());
  }

  // Whether a smaller step would do, and so whether contacts are too stiff or the inertia is wrong.
  void search_step(const DropWorld& world) {
    if (context_.effort == Effort::quick) {
      out_.notes.push_back("quick: whether it passes at a smaller step was not tried");
      return;
    }
    for (const double step : {0.25e-3, 0.125e-3}) {
      CheckResult probe = begin_result("T6");
      DropJudge judge(context_, probe);
      judge.judge_fall(fall(world, step), limits_.settling);
      if (probe.verdict == Verdict::failed) continue;
      out_.notes.push_back(fmt::format(
          "it passes at a step of {:.3g} ms: the contact is too stiff for larger steps", 1e3 * step));
      return;
    }
    out_.notes.push_back("it passes at no step down to 0.125 ms: the inertia or a shape is wrong");
  }

  void summarise(const std::vector<Fall>& falls) {
    double settled = 0, depth = 0;
    for (const Fall& fall : falls) {
      if (is_larger_step(fall)) continue;
      settled = std::max(settled, fall.settled.value_or(kDuration));
      depth = std::max(depth, fall.final_depth);
    }
    out_.metrics.push_back({"settling", "", settled, "s", limits_.settling});
    out_.metrics.push_back({"penetration", "", depth, "m", limits_.penetration});
    out_.summary =
        fmt::format("settled by {:.2f} s (limit {:.3g} s), penetration {:.2f} mm (limit {:.3g} mm)", settled,
                    limits_.settling, 1e3 * depth, 1e3 * limits_.penetration);
  }

  static constexpr const char* kInertiaFix = "the mass and inertia of the link: doppel check, doppel mass";
  const CheckContext& context_;
  const DropLimits& limits_;
  CheckResult& out_;
  FailureRecorder recorder_;
};

}  // namespace

CheckResult check_drop(const CheckContext& context) {
  CheckResult out = begin_result("T6");
  DropJudge(context, out).run();
  return out;
}

}  // namespace doppel
