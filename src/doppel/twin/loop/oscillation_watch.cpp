#include "doppel/twin/loop/detail/oscillation_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/twin/loop/rest_check.h"

namespace doppel {
namespace {

constexpr int kMaxWindows = 5;       // in which a slow oscillation has kMinTurns reversals
constexpr int kMinTurns = 4;         // reversals of direction
constexpr double kStillThere = 0.5;  // of the first half's amplitude: a faster decay is settling
constexpr double kArrived = 1e-9;    // rad or m between reference and target
constexpr double kNearStep = 0.2;    // of the step's rate: a higher frequency is caused by the step

// True if the link, or a link that it carries, is one of the two.
bool carries(const Instance& robot, int link, const Contact& contact) {
  const Model& model = robot.model();
  for (const BodyId& body : {contact.a, contact.b}) {
    if (body.instance != robot.index()) continue;
    int at = body.link;
    while (at > 0 && at != link)
      at =
          model.joints[static_cast<std::size_t>(model.links[static_cast<std::size_t>(at)].joint)].parent_link;
    if (at == link) return true;
  }
  return false;
}

}  // namespace

void OscillationWatch::open_window(Watched& watched, Time now) {
  watched.since = now;
  watched.early = watched.late = {};
}

void OscillationWatch::restart(Watched& watched, Time now) {
  watched.before = watched.sum = 0.0;
  watched.steps = watched.turns = watched.windows = 0;
  open_window(watched, now);
}

// If a controller holds the joint by efforts or velocities, its position is the target, which is reached
// at once.
DriveState OscillationWatch::state_of(const Instance& robot, int joint) const {
  DriveState out = robot.drive_state(joint);
  const bool by_controller = out.mode == DriveMode::effort || out.mode == DriveMode::velocity;
  if (by_controller && followed_) out.target = out.reference = followed_(joint);
  return out;
}

void OscillationWatch::look(const Instance& robot, Time now) {
  const auto q_now = robot.q(), v_now = robot.v();
  if (!model_->joints.empty() && model_->joints.front().type == JointType::floating) {
    const auto base = v_now.subspan(static_cast<std::size_t>(model_->joints.front().v), 6);
    if (std::any_of(base.begin(), base.end(), [](double v) { return std::abs(v) > kStillBase; }))
      run_.base_moved = now;
  }
  for (std::size_t j = 0; j < model_->joints.size(); ++j) {
    const ModelJoint& joint = model_->joints[j];
    const int index = static_cast<int>(j);
    Watched& watched = run_.joints[j];
    if (watched.reported || !joint.scalar() || joint.mimics()) continue;
    const DriveState drive = state_of(robot, index);
    watched.by_controller = drive.mode == DriveMode::effort || drive.mode == DriveMode::velocity;
    const bool servoed = drive.mode == DriveMode::position || (watched.by_controller && followed_);
    const bool held = servoed && drive.target == watched.target;  // NaN: nothing is followed
    if (!held || !watched.arrived || now < watched.since) {
      // A reference at its target may move again later, when a load above the effort limit moves the joint.
      watched.arrived = held && std::abs(drive.reference - drive.target) < kArrived;
      watched.target = drive.target;
      restart(watched, now);
      continue;
    }
    const double q = q_now[static_cast<std::size_t>(joint.q)];
    Extent& half = now - watched.since <= kOscillationTime / 2 ? watched.early : watched.late;
    half.low = std::min(half.low, q);
    half.high = std::max(half.high, q);
    const bool rising = v_now[static_cast<std::size_t>(joint.v)] > 0;
    if (watched.steps > 0 && rising != watched.rising) ++watched.turns;
    watched.rising = rising;
    watched.sum += q;
    ++watched.steps;
    if (now - watched.since >= kOscillationTime) evaluate(watched, index, now);
  }
}

void OscillationWatch::evaluate(Watched& watched, int joint, Time now) {
  const bool slides = model_->joints[static_cast<std::size_t>(joint)].type == JointType::prismatic;
  const Extent whole{std::min(watched.early.low, watched.late.low),
                     std::max(watched.early.high, watched.late.high)};
  const double amplitude = whole.amplitude();
  const double sag = std::abs(watched.target - watched.sum / watched.steps);
  const bool coarse =
      watched.by_controller || (run_.base_moved > Time{} && now - run_.base_moved < kOscillationTime);
  const double smallest = coarse ? (slides ? kMinSlideLoopOscillation : kMinLoopOscillation)
                                 : (slides ? kMinSlideOscillation : kMinOscillation);
  const bool shakes = amplitude >= smallest && amplitude >= kStillThere * watched.before;
  if (!shakes || watched.windows >= kMaxWindows) return restart(watched, now);
  ++watched.windows;
  const double lasted = to_seconds(kOscillationTime) * watched.windows;
  if (watched.turns >= kMinTurns && (watched.by_controller || amplitude >= kOscillationSags * sag) &&
      (watched.windows > 1 || watched.late.amplitude() >= kStillThere * watched.early.amplitude())) {
    watched.what = {joint, amplitude, 0.5 * watched.turns / lasted, sag, watched.by_controller};
    watched.reported = watched.waiting = run_.found = true;
  }
  watched.before = amplitude;
  open_window(watched, now);
}

std::vector<Oscillation> OscillationWatch::take() {
  std::vector<Oscillation> out;
  for (Watched& watched : run_.joints) {
    if (watched.waiting) out.push_back(watched.what);
    watched.waiting = false;
  }
  run_.found = false;
  return out;
}

std::string to_string(const Oscillation& oscillation, const Instance& robot) {
  const Model& model = robot.model();
  const Duration step = robot.engine().world().settings().step;
  const ModelJoint& joint = model.joints[static_cast<std::size_t>(oscillation.joint)];
  const bool slides = joint.type == JointType::prismatic;
  std::vector<Contact> contacts;
  robot.engine().contacts(contacts);
  const bool touches = std::any_of(contacts.begin(), contacts.end(), [&](const Contact& contact) {
    return carries(robot, joint.child_link, contact);
  });
  const bool leads = std::any_of(model.joints.begin(), model.joints.end(), [&](const ModelJoint& other) {
    return other.mimic_leader == oscillation.joint;
  });
  const ServoParameters& servo = robot.made_of().servos[static_cast<std::size_t>(oscillation.joint)];
  if (oscillation.by_controller) {
    return fmt::format(
        "joint '{}' oscillates by {:.2g} {} at {:.3g} Hz while its controller holds it: the gains of the "
        "controller are too high for the inertia that the joint moves, or for the controller's rate; reduce "
        "them",
        joint.name, oscillation.amplitude, slides ? "m" : "rad", oscillation.frequency);
  }
  std::string cause;
  if (oscillation.frequency * to_seconds(step) > kNearStep) {
    cause = fmt::format(
        "this is the frequency of the {:g} ms step; check with a shorter step or another integrator in a "
        "world file (doppel man worlds.md)",
        to_seconds(step) * 1e3);
  } else if (touches) {
    cause = "its link, or one that it carries, is in contact";
  } else if (leads) {
    cause = "joints are coupled to it by <mimic>; their inertias or limits may not match";
  } else if (at_effort_limit(robot, oscillation.joint)) {
    cause = fmt::format("its effort limit of {:.3g} {} is too low for its load", servo.effort,
                        slides ? "N" : "N m");
  } else {
    cause =
        "its drive and its load oscillate against each other; doppel verify shows whether the step matters";
  }
  return fmt::format("joint '{}' oscillates by {:.2g} {} at {:.3g} Hz while its drive holds it ({}): {}",
                     joint.name, oscillation.amplitude, slides ? "m" : "rad", oscillation.frequency,
                     oscillation.sag > 0
                         ? fmt::format("{:.0f} times its sag", oscillation.amplitude / oscillation.sag)
                         : std::string("it has no sag"),
                     cause);
}

}  // namespace doppel
