#pragma once
// Checks whether a robot without commands is at rest half a second after the start. One that is not is
// reported with the link and the cause, because later measurements of such a model are meaningless.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/base/core/time.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

inline constexpr Duration kRestTime{500'000'000};  // after the start
inline constexpr double kRestSpeed = 0.1;          // rad/s or m/s
inline constexpr double kBeyondLimit = 0.01;       // rad or m: a loaded drive sags slightly beyond its limit

// The position that the controller of a joint that is commanded by velocity or effort follows, rad or m; NaN:
// none.
using FollowedPosition = std::function<double(int joint)>;

// A scalar joint that moves, is beyond its limits, or is not where its leader in a <mimic> puts it.
struct UnsettledJoint {
  std::string joint, link;         // the link that it moves
  double position = 0, speed = 0;  // rad or m; rad/s or m/s
  double beyond = 0;               // rad or m outside of its limits; 0: inside
  double strayed = 0;              // rad or m from the position that its leader gives
  std::string cause;               // "no active controller commands it"
  SourceLocation where;            // of the joint
};

// "joint 'knee' (link 'shank') moves at 3.2 rad/s: ..."
DOPPEL_API std::string to_string(const UnsettledJoint& unsettled, bool slides);

struct RestReport {
  Time time{};
  std::vector<std::string> unsettled;        // one for each joint that is not at rest, in the model's order
  bool base_touches = true;                  // a floating robot touches the ground or an object
  double base_linear = 0, base_angular = 0;  // speed of a floating root, m/s and rad/s
  std::string base;                          // the complaint about a floating root that moves; "": none
};

// True if the joint's drive is at its effort limit.
DOPPEL_API bool at_effort_limit(const Instance& robot, int joint);

// The joints that are not at rest now. Allocates only if there are any.
DOPPEL_API std::vector<UnsettledJoint> find_unsettled_joints(const RobotDescription& robot,
                                                             const Instance& instance);

class DOPPEL_API RestCheck {
 public:
  // Begins at the robot's present state.
  explicit RestCheck(const Instance& robot)
      : begin_(robot.engine().time()), q0_(robot.q().begin(), robot.q().end()) {}

  // Between steps. True once, when kRestTime has passed and report() is set; a robot that was commanded
  // before gets no report.
  bool look(const RobotDescription& robot, const Instance& instance, const FollowedPosition& followed = {});
  // The same at once, if it has not looked yet.
  void conclude(const RobotDescription& robot, const Instance& instance,
                const FollowedPosition& followed = {});
  // True if look() or conclude() found the robot commanded, so that it has no report.
  [[nodiscard]] bool was_commanded() const { return looked_ && !report_; }
  [[nodiscard]] Time begin() const { return begin_; }
  // nullopt: not yet, or the robot was commanded.
  [[nodiscard]] const std::optional<RestReport>& report() const { return report_; }

 private:
  [[nodiscard]] bool commanded(const Instance& instance, const FollowedPosition& followed) const;
  void make_report(const RobotDescription& robot, const Instance& instance);

  Time begin_;
  std::vector<double> q0_;
  bool looked_ = false;
  std::optional<RestReport> report_;
};

}  // namespace doppel
