#pragma once
// The servo model: how a position command becomes torque. A reference runs to the target at no more than the
// joint's velocity limit; a spring and a damper pull the joint to the reference, clipped at the effort limit.
// So a joint sags under load by torque / stiffness, stalls where its effort ends, and its drive never takes
// it beyond its velocity limit.
//
//   tau = clip(stiffness * (q_ref - q) + damping * (v_ref - v), +-effort)
//
// A stream: targets that follow each other within kStreamGap. The reference reaches each in the time that had
// passed since the one before, as an interpolating drive does, so that 100 Hz of commands move a joint
// smoothly. At the limit: while the reference runs at the velocity limit v_ref counts half, with which the
// joint nears the limit without overshooting it. Waiting: the reference is never further ahead of the joint
// than effort / stiffness, so that a joint that was blocked is not thrown when it comes free. In the engine
// the damper acts implicitly, at the velocity of the step's end, and is at least stiffness * step: stable
// at any stiffness and inertia. The effort that is clipped is that of the step's end; while it is, the drive
// gives a constant effort and has no damper.

#include <Eigen/Core>
#include <vector>

#include "doppel/core/time.h"
#include "doppel/export.h"
#include "doppel/kinematics/kinematics.h"

namespace doppel {

inline constexpr double kMaxSag = 0.005;                // rad, over the sampled configurations
inline constexpr double kMaxSlideSag = 0.0005;          // m
inline constexpr double kFullEffortError = 0.1;         // rad
inline constexpr double kFullEffortSlideError = 0.005;  // m
inline constexpr double kStiffestFrequency = 500.0;     // rad/s
inline constexpr Duration kStreamGap{50'000'000};       // 50 ms
inline constexpr double kMinSpinUp = 1e-4;              // s, from standstill to the velocity limit

struct ServoParameters {
  double stiffness = 0;         // N m/rad or N/m
  double damping = 0;           // N m s/rad or N s/m
  double effort = kInfinity;    // N m or N
  double velocity = kInfinity;  // rad/s or m/s
  // kg m^2 or kg, of the motor behind its gear while the joint is commanded by effort: so much that the whole
  // effort takes kMinSpinUp to reach the velocity limit (a motor's mechanical time constant is 5 to 50
  // ms). Zero where what the joint carries is more. Without it a 5 N m servo turns a bare horn of 1e-6 kg m^2
  // by 5000 rad/s in 1 ms.
  double rotor_inertia = 0;
  bool ideal = false;  // follows the target exactly, whatever it carries; only on request
};

struct ServoOptions {
  // Natural frequency of the loop with the inertia that the joint carries (rad/s) and its damping ratio. A
  // hobby servo's position loop closes at 5 to 10 Hz; an industrial drive's at 20.
  double natural_frequency = 60.0;
  double damping_ratio = 1.0;
  bool ideal = false;
};

// stiffness = I w^2 and damping = 2 z sqrt(stiffness I) with I = carried_inertia. Two things raise the
// stiffness: gravity and the joint's own Coulomb friction, where they would hold it off its target by more
// than kMaxSag (a load beyond the effort limit does not count); and the drive's strength, which is all given
// at an error of kFullEffortError, as a wrist's drive is as strong as its data sheet specifies however little
// it carries (but never beyond kStiffestFrequency). Where a robot with a floating root stands on a joint's
// link (a leg, a wheel), load and damping are also those of the rest of the robot on that link. Slides have
// these constants in metres. [joints]; zero for joints without a drive. gravity: in the root link's axes.
DOPPEL_API std::vector<ServoParameters> choose_servos(const Model& model, const ServoOptions& options,
                                                      const Eigen::Vector3d& gravity);

// A joint within this of a limit that gravity presses it onto rests on the stop, not on its drive.
inline constexpr double kOnLimit = 0.002, kOnSlideLimit = 0.0002;  // rad, m

struct Sag {
  int joint = -1;
  double torque = 0;    // N m or N that gravity asks of the drive at rest
  double friction = 0;  // N m or N that Coulomb friction holds at most, that of its mimics with it
  // rad or m, from the joint to the drive's reference: torque / stiffness, and by friction anywhere from
  // `least` to `most`, (torque -+ friction) / stiffness. All 0 where the joint rests on a limit.
  double sag = 0, least = 0, most = 0;
  double margin = 0;  // effort limit - |torque|; negative: cannot hold
  bool on_limit = false;
};

struct StaticSag {
  std::vector<Sag> sags;               // one per driven joint, in the model's order
  Eigen::VectorXd torques, frictions;  // [joints], scratch
};

// Static sag of every driven joint at q. `data` is scratch. Nothing is allocated when `out` has been filled
// for this model before.
DOPPEL_API void static_sag(const Model& model, Data& data, const std::vector<ServoParameters>& servos,
                           const ConstVector& q, const Eigen::Vector3d& gravity, StaticSag& out);

}  // namespace doppel
