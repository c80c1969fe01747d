#include "doppel/control/controllers/detail/trajectory.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace doppel::jtc {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

constexpr std::uint8_t bit(Field field) {
  return static_cast<std::uint8_t>(1u << static_cast<unsigned>(field));
}

struct Boundary {
  double p, v, a;
};

// Coefficients c of p(t) = sum c_k t^k over 0 <= t <= T (s) that satisfies both boundaries in as many
// derivatives as its degree permits.
using Coefficients = double[6];

void linear(const Boundary& from, const Boundary& to, double T, Coefficients& c) {
  c[0] = from.p;
  c[1] = (to.p - from.p) / T;
}

void cubic(const Boundary& from, const Boundary& to, double T, Coefficients& c) {
  const double h = to.p - from.p;
  c[0] = from.p;
  c[1] = from.v;
  c[2] = (3 * h - (2 * from.v + to.v) * T) / (T * T);
  c[3] = (-2 * h + (from.v + to.v) * T) / (T * T * T);
}

void quintic(const Boundary& from, const Boundary& to, double T, Coefficients& c) {
  const double h = to.p - from.p, T2 = T * T, T3 = T2 * T;
  c[0] = from.p;
  c[1] = from.v;
  c[2] = from.a / 2;
  c[3] = (20 * h - (8 * to.v + 12 * from.v) * T - (3 * from.a - to.a) * T2) / (2 * T3);
  c[4] = (-30 * h + (14 * to.v + 16 * from.v) * T + (3 * from.a - 2 * to.a) * T2) / (2 * T3 * T);
  c[5] = (12 * h - 6 * (to.v + from.v) * T + (to.a - from.a) * T2) / (2 * T3 * T2);
}

}  // namespace

double shortest_angular_distance(double from, double to) {
  const double distance = std::remainder(to - from, kTurn);
  // Both directions of half a turn are equally short; the sign of to - from decides, not rounding.
  if (std::abs(std::abs(distance) - std::numbers::pi) < 1e-9) return std::copysign(distance, to - from);
  return distance;
}

Trajectory::Trajectory(std::size_t joints, std::size_t capacity) : joints_(joints) {
  offsets_.reserve(capacity + 1);
  given_.reserve(capacity + 1);
  known_.reserve(capacity + 1);
  for (auto& values : values_) values.reserve((capacity + 1) * joints);
  clear();
}

void Trajectory::clear() {
  offsets_.clear();
  given_.clear();
  known_.clear();
  for (auto& values : values_) values.clear();
  stamp_ = start_ = Time{};
  begun_ = false;
  add_point(Duration{});  // the state before
}

void Trajectory::add_point(Duration time_from_start) {
  offsets_.push_back(time_from_start);
  given_.push_back(0);
  known_.push_back(0);
  for (auto& values : values_) values.resize(offsets_.size() * joints_, 0.0);
}

std::span<double> Trajectory::give(std::size_t point, Field field) {
  given_[point + 1] |= bit(field);
  return {row(point + 1, field), joints_};
}

std::span<const double> Trajectory::values(std::size_t point, Field field) const {
  return {row(point + 1, field), joints_};
}

bool Trajectory::known(std::size_t index, Field field) const {
  return (known_[index] & bit(field)) != 0;
}

double* Trajectory::row(std::size_t index, Field field) {
  return values_[static_cast<std::size_t>(field)].data() + index * joints_;
}

const double* Trajectory::row(std::size_t index, Field field) const {
  return values_[static_cast<std::size_t>(field)].data() + index * joints_;
}

void Trajectory::zero(std::size_t index, Field field) {
  std::fill_n(row(index, field), joints_, 0.0);
  known_[index] |= bit(field);
}

void Trajectory::begin(Time now, Time before_time, const JointStates& before,
                       const std::vector<bool>& wraps) {
  begun_ = true;
  start_ = stamp_ == Time{} ? now : stamp_;
  offsets_[0] = before_time - start_;
  known_ = given_;
  known_[0] = bit(Field::positions) | bit(Field::effort);
  std::copy(before.positions.begin(), before.positions.end(), row(0, Field::positions));
  for (std::size_t j = 0; j < joints_; ++j) {
    row(0, Field::effort)[j] = std::isfinite(before.effort[j]) ? before.effort[j] : 0.0;
  }
  const auto take = [this](Field field, bool present, const std::vector<double>& values) {
    if (present) {
      std::copy(values.begin(), values.end(), row(0, field));
      known_[0] |= bit(field);
    } else if (size() > 0 && known(1, field)) {
      zero(0, field);  // as in ros2_controllers: the first segment has the same degree as the others
    }
  };
  take(Field::velocities, before.has_velocities, before.velocities);
  take(Field::accelerations, before.has_accelerations, before.accelerations);
  for (std::size_t i = 0; i + 1 < offsets_.size(); ++i) integrate(i);
  if (size() == 0 || (given_[1] & bit(Field::positions)) == 0) return;
  for (std::size_t j = 0; j < wraps.size(); ++j) {
    const double next = row(1, Field::positions)[j];
    double& start = row(0, Field::positions)[j];
    if (wraps[j]) start = next - shortest_angular_distance(start, next);
  }
}

void Trajectory::integrate(std::size_t from) {
  const std::size_t to = from + 1;
  if (known(to, Field::positions)) return;
  const double half = 0.5 * std::max(0.0, to_seconds(offsets_[to] - offsets_[from]));
  if (!known(from, Field::velocities)) zero(from, Field::velocities);
  if (!known(to, Field::velocities)) {
    if (!known(from, Field::accelerations)) zero(from, Field::accelerations);
    for (std::size_t j = 0; j < joints_; ++j) {
      row(to, Field::velocities)[j] =
          row(from, Field::velocities)[j] +
          half * (row(from, Field::accelerations)[j] + row(to, Field::accelerations)[j]);
    }
  }
  for (std::size_t j = 0; j < joints_; ++j) {
    row(to, Field::positions)[j] = row(from, Field::positions)[j] +
                                   half * (row(from, Field::velocities)[j] + row(to, Field::velocities)[j]);
  }
  known_[to] |= bit(Field::velocities) | bit(Field::positions);
}

std::size_t Trajectory::next_point(Time time) const {
  if (!begun_) return 0;
  const auto later = std::upper_bound(offsets_.begin() + 1, offsets_.end(), time - start_);
  return static_cast<std::size_t>(later - offsets_.begin()) - 1;
}

bool Trajectory::sample(Time time, Interpolation method, JointStates& out) const {
  const Duration offset = time - start_;
  if (!begun_ || size() == 0 || offset < offsets_[0]) return false;
  // The last row that is not later; row 0 as long as the first point has not been reached.
  const std::size_t from = next_point(time);
  if (from == size()) {
    copy(from, out);
  } else if (method == Interpolation::none) {
    copy(from == 0 ? 0 : from + 1, out);
  } else {
    interpolate(from, to_seconds(offset - offsets_[from]), to_seconds(offsets_[from + 1] - offsets_[from]),
                out);
  }
  return std::all_of(out.positions.begin(), out.positions.end(), [](double p) { return std::isfinite(p); });
}

void Trajectory::copy(std::size_t index, JointStates& out) const {
  std::vector<double>* const fields[] = {&out.positions, &out.velocities, &out.accelerations, &out.effort};
  for (const Field field : {Field::positions, Field::velocities, Field::accelerations, Field::effort}) {
    std::vector<double>& values = *fields[static_cast<std::size_t>(field)];
    if (known(index, field)) {
      std::copy_n(row(index, field), joints_, values.begin());
    } else {
      std::fill(values.begin(), values.end(), 0.0);
    }
  }
}

void Trajectory::interpolate(std::size_t from, double t, double duration, JointStates& out) const {
  const std::size_t to = from + 1;
  const bool velocities = known(from, Field::velocities) && known(to, Field::velocities);
  const bool accelerations =
      velocities && known(from, Field::accelerations) && known(to, Field::accelerations);
  for (std::size_t j = 0; j < joints_; ++j) {
    const auto boundary = [&](std::size_t index) {
      return Boundary{row(index, Field::positions)[j], row(index, Field::velocities)[j],
                      row(index, Field::accelerations)[j]};
    };
    Coefficients c = {};
    (accelerations ? quintic : velocities ? cubic : linear)(boundary(from), boundary(to), duration, c);
    out.positions[j] = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
    out.velocities[j] = c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5])));
    out.accelerations[j] = 2 * c[2] + t * (6 * c[3] + t * (12 * c[4] + t * 20 * c[5]));
    const double effort_from = known(from, Field::effort) ? row(from, Field::effort)[j] : 0.0;
    const double effort_to = known(to, Field::effort) ? row(to, Field::effort)[j] : 0.0;
    out.effort[j] = effort_from + (effort_to - effort_from) * (t / duration);
  }
}

}  // namespace doppel::jtc
