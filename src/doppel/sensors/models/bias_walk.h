#pragma once
// The slow walk of a bias: an Ornstein-Uhlenbeck process at equal steps, as Gazebo's noise makes it, but as a function of
// the number of the step. The values at powers of two follow from each other; one between two known values from both, as
// the middle of a bridge. So value n needs at most 2 log2(n) others, whatever was asked for before. Sources: P. Levy's
// construction (P. Glasserman, "Monte Carlo Methods in Financial Engineering", 2004, 3.1), with the conditional mean and
// variance of a stationary Gauss-Markov process; gz-sensors 8, GaussianNoiseModel.cc.

#include <array>
#include <cstdint>

#include "doppel/export.h"
#include "doppel/sensors/models/counter_random.h"

namespace doppel {

class DOPPEL_API BiasWalk {
 public:
  BiasWalk() = default;
  // first: value 0. stddev: of the driving white noise, in units per square root of s; time: of the correlation, s; period:
  // of a step, s. With one of the latter not positive, the value stays.
  BiasWalk(double first, double stddev, double time, double period, const CounterRandom& random,
           std::uint32_t channel);

  // Value n. Costs one random number where n grows by one from call to call.
  double at(std::uint64_t n);
  // Random numbers drawn so far.
  [[nodiscard]] std::uint64_t draws() const { return draws_; }
  // True if two walks with the same random numbers have the same values.
  [[nodiscard]] bool same_as(const BiasWalk& other) const {
    return first_ == other.first_ && deviation_ == other.deviation_ && decay_ == other.decay_;
  }

 private:
  struct Point {
    std::uint64_t n = 0;
    double value = 0;
  };
  double next_power(const Point& from, std::uint64_t to);
  double middle(const Point& from, const Point& to);
  double draw(std::uint64_t n);

  CounterRandom random_;
  std::uint32_t channel_ = 0;
  double first_ = 0, deviation_ = 0, decay_ = 0;  // of the process over all time; of a step: exp(-decay)
  // Known values: the last one that is not beyond n, and those on the way from the next power of two to it.
  Point left_;
  std::array<Point, 65> right_;
  std::size_t rights_ = 0;
  std::uint64_t draws_ = 0;
};

}  // namespace doppel
