#pragma once
// The servo model: how a position command becomes torque. A reference moves to the target at no more than the
// joint's velocity limit; a spring and a damper pull the joint to the reference, clipped at the effort limit.
// So a joint sags under load by torque / stiffness, stalls where the load exceeds the effort limit, and is
// never driven beyond its velocity limit.
//
//   tau = clip(stiffness * (q_ref - q) + damping * (v_ref - v), +-effort)
//
// Streams: targets that follow each other within kStreamGap. The reference reaches each of them in
// the time between it and its predecessor, as in an interpolating drive, so that commands at 100 Hz
// move a joint smoothly.
//
// Velocity commands: the reference moves at the commanded velocity, within the joint's limit, and v_ref is that
// velocity: the servo is a PI controller of the velocity, which also holds a standing wheel on a slope.
//
// Velocity limit: v_ref is a share of the reference's velocity, 1/2 after a step command, rising to 1
// (docs/physics.md), so that the joint approaches the limit without overshooting it.
//
// Effort commands: the commanded effort, which falls to zero over the last percent below the velocity limit,
// as that of a motor at its no-load speed; it does not brake a joint that something else moves faster.
//
// Wind-up: the reference is never further ahead of the joint than effort / stiffness, so that a blocked joint
// is not thrown when it is released.
//
// Integration: the damper is implicit, at the velocity of the step's end, and at least stiffness * step,
// which is stable at any stiffness and inertia. The clipped effort is that of the step's end; while it is
// clipped, the drive exerts a constant effort without a damper.

#include <Eigen/Core>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {

inline constexpr double kMaxSag = 0.005;                // rad, over the sampled configurations
inline constexpr double kMaxSlideSag = 0.0005;          // m, the same for prismatic joints
inline constexpr double kFullEffortError = 0.1;         // rad, position error with the whole effort
inline constexpr double kFullEffortSlideError = 0.005;  // m, the same for prismatic joints
inline constexpr double kStiffestFrequency = 500.0;     // rad/s
inline constexpr Duration kStreamGap{50'000'000};       // 50 ms
inline constexpr double kMinSpinUp = 1e-4;              // s, from standstill to the velocity limit

struct ServoParameters {
  double stiffness = 0;         // N m/rad or N/m
  double damping = 0;           // N m s/rad or N s/m
  double effort = kInfinity;    // N m or N
  double velocity = kInfinity;  // rad/s or m/s
  // kg m^2 or kg: reflected inertia of the motor while the joint is commanded by effort, such that the whole
  // effort takes kMinSpinUp to reach the velocity limit (a motor's mechanical time constant is 5 to 50 ms).
  // Zero where the carried inertia is larger. Without it a 5 N m servo accelerates a bare horn of 1e-6 kg m^2
  // to 5000 rad/s in 1 ms.
  double rotor_inertia = 0;
  bool ideal = false;  // follows the target exactly, whatever it carries; only on request
  // kg m^2 or kg: reflected inertia of the motor in every mode, beside that of the links; described
  // (described_servo.h) or 0.
  double armature = 0;
};

struct ServoOptions {
  // Natural frequency (rad/s) and damping ratio (1) of the position loop with the carried inertia. A hobby
  // servo's position loop has 5 to 10 Hz, an industrial drive's 20 Hz.
  double natural_frequency = 60.0;
  double damping_ratio = 1.0;
  bool ideal = false;
};

// One servo per joint [joints]; zero for joints without a drive. gravity: m/s^2, in the root link's axes.
//
// stiffness = I w^2 and damping = 2 z sqrt(stiffness I) with I = carried_inertia(). The stiffness is raised
// - so that gravity and the joint's Coulomb friction hold it off its target by at most kMaxSag (a load beyond
//   the effort limit does not count);
// - so that the whole effort is given at an error of kFullEffortError, because a wrist's drive is as strong
//   as its data sheet specifies however little it carries, but not beyond a frequency of kStiffestFrequency.
// Where a robot with a floating root stands on a joint's link (a leg, a wheel), load and damping also include
// the rest of the robot on that link. Prismatic joints use the constants in metres.
DOPPEL_API std::vector<ServoParameters> choose_servos(const Model& model, const ServoOptions& options,
                                                      const Eigen::Vector3d& gravity);

// A joint this close to a limit against which gravity loads it rests on the stop, not on its drive.
inline constexpr double kOnLimit = 0.002, kOnSlideLimit = 0.0002;  // rad, m

struct Sag {
  int joint = -1;
  double torque = 0;    // N m or N: load of gravity on the drive at rest
  double friction = 0;  // N m or N: the most that Coulomb friction can hold, including that of its mimics
  // rad or m, from the joint to the drive's reference: torque / stiffness. Friction can stop the
  // joint anywhere from `least` to `most`, (torque -+ friction) / stiffness. All 0 where the joint
  // rests on a limit.
  double sag = 0, least = 0, most = 0;
  double margin = 0;  // N m or N: effort limit - |torque|; negative: the drive cannot hold the joint
  bool on_limit = false;
};

struct StaticSag {
  std::vector<Sag> sags;               // one per driven joint, in the model's order
  Eigen::VectorXd torques, frictions;  // [joints] N m or N, scratch
};

// Static sag of every driven joint at q [nq] under gravity (m/s^2, in the root link's axes). `data` is
// scratch. Does not allocate when `out` has been filled for this model before.
DOPPEL_API void static_sag(const Model& model, Data& data, const std::vector<ServoParameters>& servos,
                           const ConstVector& q, const Eigen::Vector3d& gravity, StaticSag& out);

}  // namespace doppel
