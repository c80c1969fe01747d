#include "doppel/review/identification/excitation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace doppel {
namespace {

constexpr double kMargin = 0.05;                      // of the range, to a limit
constexpr double kMaxTurn = 0.6, kMaxSlide = 0.05;    // rad, m
constexpr double kMinTurn = 0.05, kMinSlide = 0.005;  // rad, m: less excites nothing
constexpr double kFreeTurn = 2.0, kFreeSlide = 0.2;   // rad/s, m/s, of a joint without a limit
constexpr double kRest = 1.0;                         // s
constexpr double kTriangleShare = 12.0 / 54, kStepShare = 12.0 / 54;  // of the time
constexpr double kTriangleSpeed = 0.2;                                // of the joint's limit
constexpr double kMovingShare = 0.5;                                  // of the time of a step
constexpr double kPeriod = 0.02;                                      // s, of waypoints on curves
constexpr double kFade = 2.0;                                         // s
constexpr std::array kLevels{0.1, -0.1, 0.2, -0.2, 0.4, -0.4, 0.7, -0.7, 1.0, -1.0, 0.0};

double speed_of(const ExcitationRange& range) {
  const double limit = std::isfinite(range.speed) && range.speed > 0 ? range.speed
                       : range.slides                                ? kFreeSlide
                                                                     : kFreeTurn;
  return kExcitationSpeed * limit;
}

class Path {
 public:
  explicit Path(double middle) : middle_(middle) {}
  void hold(double seconds) { add(seconds, now()); }
  void add(double seconds, double offset) {
    if (!(seconds > 0)) return;
    time_ += seconds;
    offset_ = offset;
    points_.push_back({time_, middle_ + offset});
  }
  [[nodiscard]] double now() const { return offset_; }
  [[nodiscard]] std::vector<Waypoint> points() const { return points_; }

 private:
  double middle_, time_ = 0, offset_ = 0;
  std::vector<Waypoint> points_;
};

void add_triangle(Path& path, double amplitude, double speed, double seconds) {
  const double way = std::min(amplitude, speed * kTriangleSpeed / kExcitationSpeed * seconds / 8);
  for (int period = 0; period < 2; ++period) {
    path.add(seconds / 8, way);
    path.add(seconds / 4, -way);
    path.add(seconds / 8, 0);
  }
}

void add_steps(Path& path, double amplitude, double speed, double seconds) {
  const double dwell = seconds / static_cast<double>(kLevels.size());
  const double size = std::min(amplitude, 0.5 * kMovingShare * dwell * speed);
  for (const double level : kLevels) {
    const double moving = std::abs(level * size - path.now()) / speed;
    path.add(moving, level * size);
    path.hold(dwell - moving);
  }
}

void add_harmonics(Path& path, double amplitude, double speed, double seconds, const FourierSeries& shape) {
  const auto series = [&](double t) {
    return shape.value(t) * std::clamp(std::min(t, seconds - t) / kFade, 0.0, 1.0);
  };
  const int count = static_cast<int>(seconds / kPeriod);
  double highest = 0, fastest = 0;
  for (int i = 1; i <= count; ++i) {
    highest = std::max(highest, std::abs(series(i * kPeriod)));
    fastest = std::max(fastest, std::abs(series(i * kPeriod) - series((i - 1) * kPeriod)) / kPeriod);
  }
  const double scale = std::min(amplitude / highest, speed / fastest);
  for (int i = 1; i < count; ++i) path.add(kPeriod, scale * series(i * kPeriod));
  path.add(kPeriod, 0);
}

}  // namespace

double FourierSeries::value(double time) const {
  double sum = 0;
  for (int k = 1; k <= kHarmonics; ++k) {
    const double angle = 2 * std::numbers::pi * kBaseFrequency * k * time;
    const auto i = static_cast<std::size_t>(k - 1);
    sum += a[i] * std::sin(angle) + b[i] * std::cos(angle);
  }
  return sum;
}

FourierSeries schroeder_series() {
  FourierSeries out;
  for (int k = 1; k <= kHarmonics; ++k) {
    const double phase = -std::numbers::pi * k * (k - 1) / kHarmonics;
    out.a[static_cast<std::size_t>(k - 1)] = std::cos(phase) / k;
    out.b[static_cast<std::size_t>(k - 1)] = std::sin(phase) / k;
  }
  return out;
}

double excitation_amplitude(const ExcitationRange& range) {
  const double width = range.upper - range.lower;
  const double margin = std::isfinite(width) ? kMargin * width : 0.0;
  const double room = std::min(range.upper - range.position, range.position - range.lower) - margin;
  const double most = range.slides ? kMaxSlide : kMaxTurn, least = range.slides ? kMinSlide : kMinTurn;
  const double furthest = std::min({room, most, range.furthest});
  return furthest < least ? 0.0 : furthest;
}

std::vector<Waypoint> plan_excitation(const ExcitationRange& range, double seconds,
                                      const FourierSeries& series) {
  const double amplitude = excitation_amplitude(range), speed = speed_of(range);
  const double moving = std::max(seconds, kMinExcitation) - 2 * kRest;
  const double triangle = kTriangleShare * moving, steps = kStepShare * moving;
  Path path(range.position);
  path.hold(kRest);
  add_triangle(path, amplitude, speed, triangle);
  add_steps(path, amplitude, speed, steps);
  add_harmonics(path, amplitude, speed, moving - triangle - steps, series);
  path.hold(kRest);
  return path.points();
}

std::vector<Waypoint> plan_harmonics(const ExcitationRange& range, double seconds,
                                     const FourierSeries& series) {
  Path path(range.position);
  path.hold(kRest);
  add_harmonics(path, excitation_amplitude(range), speed_of(range), seconds, series);
  path.hold(kRest);
  return path.points();
}

std::vector<Waypoint> plan_rehearsal(const ExcitationRange& range) {
  const double amplitude = excitation_amplitude(range), speed = kRehearsalSpeed * speed_of(range);
  Path path(range.position);
  for (const double offset : {amplitude, -amplitude, 0.0})
    path.add(std::abs(offset - path.now()) / speed, offset);
  path.hold(kRest);
  return path.points();
}

}  // namespace doppel
