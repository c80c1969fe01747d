#pragma once
// A joint trajectory as it is executed: points in structure of arrays, preceded by the state it starts from,
// sampled as polynomials. Positions in rad or m, their derivatives by second, effort in N m or N. Filled
// between steps; begin() and sample() run in the loop and neither allocate nor throw. Source of the
// polynomials: Biagiotti, Melchiorri, "Trajectory Planning for Automatic Machines and Robots" (2008), 2.1.

#include <cstdint>
#include <span>
#include <vector>

#include "doppel/core/time.h"

namespace doppel::jtc {

enum class Interpolation { splines, none };

// All joints at one instant, one array of [joints] each; the arrays are always there, the flags state what is
// measured.
struct JointStates {
  explicit JointStates(std::size_t joints = 0)
      : positions(joints), velocities(joints), accelerations(joints), effort(joints) {}
  std::vector<double> positions, velocities, accelerations, effort;
  bool has_velocities = true, has_accelerations = true;
};

enum class Field : std::uint8_t { positions = 0, velocities = 1, accelerations = 2, effort = 3 };

// (-pi, pi], the short way from one angle to another; at exactly half a turn in the direction of to - from.
double shortest_angular_distance(double from, double to);

class Trajectory {
 public:
  // Room for `capacity` points.
  Trajectory(std::size_t joints, std::size_t capacity);

  // -- filling it; within the capacity without allocation
  void clear();
  // Appends a point without any field. Precondition: later than the last one.
  void add_point(Duration time_from_start);
  // The [joints] values of a field, which the point has from now on.
  std::span<double> give(std::size_t point, Field field);
  // When time_from_start is 0; Time{}: at the begin().
  void set_stamp(Time stamp) { stamp_ = stamp; }

  // -- running it
  // From `before`, known at `before_time` (<= now). Where `wraps` is true, the start is shifted by whole
  // turns so that the first move is the short way. What the first point has and `before` lacks starts at
  // zero. Positions that points lack are integrated from velocities, and these from accelerations, by Heun's
  // trapezoid.
  void begin(Time now, Time before_time, const JointStates& before, const std::vector<bool>& wraps);
  [[nodiscard]] bool begun() const { return begun_; }
  // False: there is nothing to say (not begun, earlier than `before`, positions unknown), and `out` is
  // undefined.
  bool sample(Time time, Interpolation method, JointStates& out) const;

  [[nodiscard]] std::size_t joints() const { return joints_; }
  [[nodiscard]] std::size_t size() const { return offsets_.size() - 1; }  // points
  [[nodiscard]] Time start_time() const { return start_; }                // once begun
  [[nodiscard]] Time end_time() const { return start_ + offsets_.back(); }
  [[nodiscard]] bool has(std::size_t point, Field field) const { return known(point + 1, field); }
  [[nodiscard]] std::span<const double> values(std::size_t point, Field field) const;

 private:
  // Row 0 is the state before the trajectory, row i + 1 its point i.
  [[nodiscard]] bool known(std::size_t row, Field field) const;
  [[nodiscard]] double* row(std::size_t index, Field field);
  [[nodiscard]] const double* row(std::size_t index, Field field) const;
  void zero(std::size_t index, Field field);
  void integrate(std::size_t from);
  void copy(std::size_t index, JointStates& out) const;
  void interpolate(std::size_t from, double t, double duration, JointStates& out) const;

  std::size_t joints_;
  std::vector<Duration> offsets_;  // [1 + points] from the start
  std::vector<std::uint8_t> given_,
      known_;                      // [1 + points] bit per field: by the message; with what was deduced
  std::vector<double> values_[4];  // [1 + points, joints] by field
  Time stamp_{}, start_{};
  bool begun_ = false;
};

}  // namespace doppel::jtc
