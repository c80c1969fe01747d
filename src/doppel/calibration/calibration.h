#pragma once
// Direction, zero and scale of a joint from measurements: what the model says and what the machine says at
// the same pose. The machine's value is fitted as a line over the model's,
//     machine = direction * scale * model + offset,
// by least squares. One measurement separates nothing; two have to be at least 60 degrees apart, so that an
// error of reading of a degree turns no sign and moves the scale by 2 % at most.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/overlay/operation.h"

namespace doppel {

struct Measurement {
  double model = 0;    // the joint's position in the model as it is now: rad or m
  double machine = 0;  // the machine's own number (the servo's) at the same pose: rad or m
};

struct DOPPEL_API JointFit {
  std::string joint;
  int direction = 1;              // -1: the model turns the other way
  double scale = 1;               // machine per model, positive
  double offset = 0;              // the machine's number where the model is at zero: rad or m
  std::vector<double> residuals;  // machine minus fit, of each measurement: rad or m
  // Where the machine counts 0 to 360 degrees and the line went over that edge: the machine's numbers as they
  // would lie on one line, rad, beside the measurements; else empty.
  std::vector<double> unwrapped;
  [[nodiscard]] double worst_residual() const;
};

inline constexpr double kMinSpread = 60.0 * 0.017453292519943295;  // rad, between the model's values
inline constexpr double kScaleTolerance = 0.02;                    // more than this is no error of reading

// Throws InputError: fewer than two measurements, all within 60 degrees (for a prismatic joint: within a
// third of its range), a machine that did not move, a scale beyond a factor of 2, residuals beyond 5 degrees,
// a joint that is unknown, fixed or a mimic.
DOPPEL_API JointFit fit_joint(const Joint& joint, std::span<const Measurement> measurements);

enum class LimitChoice {
  keep,  // the numbers stay: they were the machine's all along, as a servo's 0 to 180 degrees
  move,  // the places stay: the stops of the model's geometry get the machine's numbers
};

// The operations that make the model's number the machine's: FlipAxis where the direction is -1, BakeZero
// where the zero differs (R_new = R_old R_axis(-offset)), SetLimit where `limits` says so. The scale cannot
// be baked into geometry; it is the driver's.
DOPPEL_API std::vector<Operation> calibration_operations(const Joint& joint, const JointFit& fit,
                                                         std::span<const Measurement> measurements,
                                                         LimitChoice limits);

// The corrections that measurements of before made. A measurement is of the model as it was then: taken
// again, it would count twice. `corrections`: the overlay's; found where one of the joint's was made of one
// of these very measurements, or turns it around or moves its zero as these would once more.
DOPPEL_API std::optional<std::size_t> correction_made_of(const std::vector<Operation>& corrections,
                                                         const std::string& joint,
                                                         const std::vector<Operation>& fresh);
// The joint's directions and zeros among the corrections, whoever made them; joints go by their last names.
DOPPEL_API std::vector<std::size_t> zeros_of(const std::vector<Operation>& corrections,
                                             const std::string& joint);

// -- measurements as people write them
struct NamedMeasurements {
  std::string joint;
  std::vector<Measurement> measurements;
};
// "Revolute 2: 0=45 90=135": model=machine, in degrees for revolute joints, in millimetres for prismatic
// ones. Throws InputError for what is not of that form, and for a joint that the robot does not have, with
// the nearest.
// One number of them; nothing where it is none.
DOPPEL_API std::optional<double> measured_number(std::string_view text);
DOPPEL_API NamedMeasurements parse_measurements(const std::string& text, const RobotDescription& robot);

}  // namespace doppel
