#pragma once
// Parameters of one joint's servo from a recording of its command and its position: prediction error of the
// whole trajectory, by Levenberg-Marquardt in the logarithms of the parameters. The model is that of
// physics/contract/servo.h with delay and friction (docs/identification.md).

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// In the order of ServoValues. Units of a revolute joint; a prismatic joint has N and m in place of N m and
// rad.
enum class ServoQuantity : std::size_t {
  delay,        // s, command to reference
  velocity,     // rad/s, of the reference
  effort,       // N m
  stiffness,    // N m/rad
  damping,      // N m s/rad
  armature,     // kg m^2, beside the inertia that the links have
  viscous,      // N m s/rad
  friction,     // N m, Coulomb
  breakaway,    // N m, static friction above Coulomb's
  stribeck,     // rad/s, velocity over which it falls to 1/e
  load_factor,  // 1, friction per effort of the drive
  backlash,     // rad, the whole play
};
inline constexpr std::size_t kServoQuantities = 12;
using ServoValues = std::array<double, kServoQuantities>;
DOPPEL_API std::string_view name_of(ServoQuantity quantity);  // "stiffness", the key in files
DOPPEL_API std::string unit_of(ServoQuantity quantity, bool slides);

// The ladder; each rung adds to the previous one.
enum class FrictionRung { none, coulomb, stribeck, load, backlash };
inline constexpr int kFrictionRungs = 5;
DOPPEL_API std::string_view name_of(FrictionRung rung);  // "M0" ...

// The torque of the servo is off from `begin` to `end`, and its damping with it. Then it holds where it
// was caught, until it follows the commands again.
struct ReleasedSpan {
  double begin = 0, end = 0;  // s
  double caught = 0;          // rad or m
  double follows = 0;         // s, of the first command that it follows
};

// Samples of one joint at rising times. Load and inertia are those of the links along the measured motion:
// `load` is what the drive has to exert beside inertia * acceleration (gravity, other joints' motion).
struct JointRecord {
  std::vector<double> command_time;   // s
  std::vector<double> command;        // rad or m, at command_time
  std::vector<double> time;           // s, of the position; another clock would be a delay
  std::vector<double> position;       // rad or m, as measured
  std::vector<double> load, inertia;  // N m, kg m^2 or N, kg
  double tick = 0;                    // rad or m, resolution of the position; 0: from the data
  // Share by which the inertia is smaller in the first moment of a motion, in which the other joints yield;
  // their motion within a sample is not in `load`.
  double yielding = 0;
  std::vector<ReleasedSpan> released = {};  // rising, apart from each other
};

struct FitOptions {
  ServoValues start{};  // of the description; positive
  FrictionRung last = FrictionRung::backlash;
  // Called with the number of simulations so far; false ends the fit with FitCancelled.
  std::function<bool(int)> progress = {};
};
struct FitCancelled {};

struct FittedValue {
  double value = 0, low = 0, high = 0;  // 95 % interval
  bool fitted = false;                  // false: not of this rung, or the start is kept
  std::string problem;                  // empty: identified; else "not identifiable, because ..."
};

struct CorrelatedPair {
  ServoQuantity a, b;
  double correlation = 0;
};

struct RungResult {
  FrictionRung rung = FrictionRung::none;
  double training_rms = 0, held_out_rms = 0, bic = 0;  // rad or m
};

struct DOPPEL_API ServoFit {
  std::array<FittedValue, kServoQuantities> values;
  FrictionRung rung = FrictionRung::none;
  std::vector<RungResult> ladder;
  std::vector<CorrelatedPair> correlated;  // above 0.95
  std::vector<ServoQuantity> at_bound;
  double rms = 0, held_out_rms = 0, tick = 0;  // rad or m
  double inflation = 1;                        // of the variances, by the correlation of the residuals
  double ljung_box = 0;                        // over 10 lags, of the samples in motion
  double white_probability = 1;                // of it under white residuals
  double structure = 0;  // share of the residuals' variance that resolution and noise do not explain
  double velocity_share = 0, effort_share = 0;  // share of time at the limit
  bool is_white = true, scale_known = true;
  std::vector<std::string> warnings;
  std::vector<double> predicted;  // rad or m, at the record's times
  int simulations = 0;

  [[nodiscard]] const FittedValue& operator[](ServoQuantity quantity) const {
    return values[static_cast<std::size_t>(quantity)];
  }
  // It has an interval, and no reason speaks against it, if the model fits.
  [[nodiscard]] bool is_identified(ServoQuantity quantity) const;
  // Values may be written without a person's consent.
  [[nodiscard]] bool is_trusted(ServoQuantity quantity) const;
};

// Throws InputError: too few samples, or a joint that does not move. FitCancelled as `progress` says.
DOPPEL_API ServoFit fit_servo(const JointRecord& record, const FitOptions& options);

// The smallest step between two positions that differ, if all are multiples of it; 0: not quantised.
DOPPEL_API double estimate_tick(std::span<const double> positions);

}  // namespace doppel
