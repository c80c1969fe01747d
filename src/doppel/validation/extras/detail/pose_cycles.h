#pragma once
// The test cycles of ISO 9283 in a twin: five poses on the diagonal plane of a cube.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/validation/extras/detail/extra_arm.h"
#include "doppel/validation/metrics/pose_accuracy.h"

namespace doppel {

inline constexpr std::size_t kTestPoses = 5;

struct TestPlane {
  double edge = 0;                                   // m: of the cube, parallel to the root link's axes
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, root link
  std::array<Eigen::VectorXd, kTestPoses> q;         // [nq]: P1 in the centre, P2 to P5 near the corners
  bool orientation = true;  // of the tool is the same in all; else each pose has its own

  // "cube of 0.123 m around (0.1, 0.2, 0.3)".
  [[nodiscard]] std::string text() const;
};
inline constexpr const char* kNoPlane = ": no cube is found whose test poses it reaches";

// The largest cube of a search whose five poses the arm reaches in one orientation of its tool (as much of it
// as the arm sets; else in any) without touching itself. nullopt: it finds none.
[[nodiscard]] std::optional<TestPlane> find_test_plane(const CheckContext& context, const ExtraArm& arm);

// A result that several extras of a validation need is computed once (SharedResults).
template <class T, class Make>
std::shared_ptr<const T> shared_result(const CheckContext& context, const std::string& name,
                                       const Make& make) {
  return context.shared != nullptr ? context.shared->get<T>(name, make) : std::make_shared<const T>(make());
}
[[nodiscard]] std::shared_ptr<const std::optional<TestPlane>> shared_test_plane(const CheckContext& context,
                                                                                const ExtraArm& arm);

// One approach to a pose.
struct PoseApproach {
  MeasuredPose attained;                   // mean of the end of the rest; angles against the commanded pose
  std::vector<double> time;                // s since the begin of the motion
  std::vector<Eigen::Vector3d> positions;  // m, root link
};

struct PoseCycles {
  std::array<MeasuredPose, kTestPoses> commanded;
  std::array<std::vector<PoseApproach>, kTestPoses> approaches;  // [pose][cycle]
  double motion_time = 0;                                        // s that the command takes to each pose
  double cycle_time = 0;                                         // s, with the rests
  bool varies = false;  // the arm has something that makes cycles differ: friction, servos' errors
  std::string servos;   // ServoErrors::text()
  // J and W, of the drives that are judged, a cycle in the mean; W of the sum that drives take, without what
  // they give back.
  double energy = 0, mean_power = 0, peak_power = 0;
  std::vector<double> power_time, power;  // s, W: the last cycle
};

// Approaches of P1, P2 and P4 from three directions, parallel to the root link's axes (7.3.1).
inline constexpr std::array<std::size_t, 3> kDirectionPoses = {0, 1, 3};
struct PoseDirections {
  std::array<MeasuredPose, 3> commanded;
  // [pose][direction][cycle]; without the directions from which the arm cannot come.
  std::array<std::vector<std::vector<MeasuredPose>>, 3> attained;
};
// `cycles` for each direction, fewer if they take long. A string: why not.
[[nodiscard]] std::string run_pose_directions(const CheckContext& context, const ExtraArm& arm,
                                              const TestPlane& plane, int cycles, PoseDirections& out);

// P5, P1, P2, ... through the arm's controllers at half of the speed limits, `cycles` times (fewer if they
// take long) after one that does not count. A string: why not.
[[nodiscard]] std::string run_pose_cycles(const CheckContext& context, const ExtraArm& arm,
                                          const TestPlane& plane, int cycles, PoseCycles& out);

}  // namespace doppel
