#pragma once
// A motion for the identification of an arm's servos, joint by joint, which stays within the limits, touches
// nothing, and needs at most kExcitationSpeed of the speed and kMaxEffort of the effort limits; as a file
// with the hash of the arm that it is for.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/review/identification/excitation.h"
#include "doppel/review/identification/payload.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

inline constexpr double kMaxEffort = 0.6;  // of the joint's effort limit: gravity and smooth motion

// Lift and release: at rest at `lift` the torque of the joint goes off, kReleases times. It is on again at
// an end of the interval, at `speed`, or after `duration`.
struct PlannedRelease {
  double lift = 0;              // rad or m
  double lower = 0, upper = 0;  // rad or m
  double speed = 0;             // rad/s or m/s
  double duration = 0;          // s
};
inline constexpr int kReleases = 3;

struct PlannedJoint {
  std::string joint;
  double condition = 0;          // of the Jacobian whose columns are scaled to one length, in the harmonics
  double speed = 0, effort = 0;  // shares of the limits; effort: of gravity and the harmonics
  std::vector<Waypoint> path;
  std::optional<PlannedRelease> release = {};  // nullopt: omitted, with a note
};

struct MotionPlan {
  std::string robot, arm;              // name; hash of arm_hash()
  std::map<std::string, double> pose;  // rad or m, of all driven joints: where the motions begin and end
  std::vector<PlannedJoint> joints;
  std::vector<std::string> notes;
  std::optional<Payload> payload = {};  // that the arm carries in the motions
};

struct PlanOptions {
  std::vector<std::string> joints;  // empty: all that are driven
  double seconds = kUsualExcitation;
  Eigen::VectorXd q;  // [nq]; a joint without room there is moved to the middle of its range
  std::optional<Payload> payload = {};  // counts in the efforts; its shape is not known
};

// 16 digits over the tree: names, types, frames, axes, masses, and the limits of position and velocity.
DOPPEL_API std::string arm_hash(const Model& model);

// The series of each joint is the one of a fixed set of candidates with the least condition number. A joint
// for which there is no motion is left out, with a note. Throws InputError: the robot touches itself in the
// pose, a joint has no room, or no joint is left.
DOPPEL_API MotionPlan plan_motion(const RobotDescription& robot, const Model& model,
                                  const PlanOptions& options);

DOPPEL_API std::string to_yaml(const MotionPlan& plan);
// Throws InputError with the place: no plan, unknown keys or values.
DOPPEL_API MotionPlan read_motion_plan(const std::filesystem::path& file);
// Throws InputError: the plan is of another arm, or leaves its limits of position or speed.
DOPPEL_API void check_plan(const MotionPlan& plan, const Model& model, const std::string& file);

}  // namespace doppel
