#pragma once
// A joint trajectory for execution: points as a structure of arrays, preceded by the initial state, sampled
// as polynomials. Positions in rad or m, their derivatives per s and s^2, effort in N m or N. Filled between
// steps; begin() and sample() run in the loop and neither allocate nor throw. Source of the polynomials:
// Biagiotti, Melchiorri, "Trajectory Planning for Automatic Machines and Robots" (2008), 2.1.

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "doppel/base/core/time.h"

namespace doppel::jtc {

enum class Interpolation { splines, none };

// All joints at one instant, one array [joints] per field; all arrays exist, and the flags state
// which are measured.
struct JointStates {
  explicit JointStates(std::size_t joints = 0)
      : positions(joints), velocities(joints), accelerations(joints), effort(joints) {}
  std::vector<double> positions, velocities, accelerations, effort;
  bool has_velocities = true, has_accelerations = true;
};

enum class Field : std::uint8_t { positions = 0, velocities = 1, accelerations = 2, effort = 3 };

// rad in [-pi, pi]: the shortest rotation from one angle to another; at half a turn with the sign of
// to - from.
double shortest_angular_distance(double from, double to);

class Trajectory {
 public:
  // Room for `capacity` points.
  explicit Trajectory(std::size_t joints = 0, std::size_t capacity = 0);

  // -- filling; does not allocate within the capacity
  void clear();
  // Appends a point without fields. Precondition: it is later than the last one.
  void add_point(Duration time_from_start);
  // Adds a field to the point and returns its values [joints].
  std::span<double> give(std::size_t point, Field field);
  // The time at which time_from_start is 0; Time{}: that of begin().
  void set_stamp(Time stamp) { stamp_ = stamp; }

  // -- execution
  // Starts from `before`, valid at `before_time` (<= now). Where `wraps` is true, the start is shifted by
  // whole turns so that the first move is the shortest. A field that the first point has and `before` lacks
  // starts at zero. Missing positions are integrated from velocities, and these from accelerations, by the
  // trapezoidal rule (Heun), as in ros2_controllers.
  void begin(Time now, Time before_time, const JointStates& before, const std::vector<bool>& wraps);
  [[nodiscard]] bool begun() const { return begun_; }
  // False: there is no sample (not begun, earlier than `before`, or positions unknown), and
  // `out` is undefined.
  bool sample(Time time, Interpolation method, JointStates& out) const;

  // The first point that is later than the time; size(): none. 0 before begin().
  [[nodiscard]] std::size_t next_point(Time time) const;

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

// The trajectory of a message, or none. It does not change any more once it has begun, and copies share it
// then, so that a saved state of a long one costs nothing.
class ReceivedTrajectory {
 public:
  ReceivedTrajectory() = default;
  ReceivedTrajectory(std::unique_ptr<Trajectory> trajectory) : trajectory_(std::move(trajectory)) {}
  ~ReceivedTrajectory() = default;
  ReceivedTrajectory(const ReceivedTrajectory& other) : trajectory_(other.copy()) {}
  ReceivedTrajectory(ReceivedTrajectory&&) noexcept = default;
  ReceivedTrajectory& operator=(const ReceivedTrajectory& other) {
    if (this != &other) trajectory_ = other.copy();
    return *this;
  }
  ReceivedTrajectory& operator=(ReceivedTrajectory&&) noexcept = default;
  [[nodiscard]] Trajectory* get() const { return trajectory_.get(); }
  void reset() { trajectory_.reset(); }

 private:
  [[nodiscard]] std::shared_ptr<Trajectory> copy() const {
    const bool shared = trajectory_ == nullptr || trajectory_->begun();
    return shared ? trajectory_ : std::make_shared<Trajectory>(*trajectory_);
  }
  std::shared_ptr<Trajectory> trajectory_;
};

}  // namespace doppel::jtc
