#pragma once
// Direction, zero and scale of a joint from measurements: pairs of the model's and the machine's position at
// the same pose. The machine's position is fitted as a line over the model's by least squares,
//
//   machine = direction * scale * model + offset.
//
// One measurement cannot determine both direction and offset; two have to be at least 60 degrees apart, so
// that a reading error of one degree cannot change the sign and changes the scale by at most 2 %.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/overlay/operation.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct Measurement {
  double model = 0;    // the joint's position in the present model: rad or m
  double machine = 0;  // the position that the machine (the servo) reports at the same pose: rad or m
};

struct DOPPEL_API JointFit {
  std::string joint;
  int direction = 1;              // -1: the model turns the other way
  double scale = 1;               // machine per model, positive
  double offset = 0;              // the machine's position where the model is at zero: rad or m
  std::vector<double> residuals;  // machine minus fit, of each measurement: rad or m
  // If the machine counts 0 to 360 degrees and the measurements cross that boundary: the machine's positions
  // on one line, rad, for each measurement; else empty.
  std::vector<double> unwrapped;
  [[nodiscard]] double worst_residual() const;
};

inline constexpr double kMinSpread = 60.0 * 0.017453292519943295;  // rad, between the model's values
inline constexpr double kScaleTolerance = 0.02;  // a larger deviation is not a reading error

// Throws InputError: fewer than two measurements, or all of them within 60 degrees (for a prismatic joint:
// within a third of its range).
DOPPEL_API void check_spread(const Joint& joint, std::span<const Measurement> measurements);
// Least-squares fit. Throws InputError as check_spread(), and for a machine that did not move, a scale beyond
// a factor of 2, residuals beyond 5 degrees, a joint that is unknown, fixed or a mimic.
DOPPEL_API JointFit fit_joint(const Joint& joint, std::span<const Measurement> measurements);

enum class LimitChoice {
  keep,  // the values stay, because they are the machine's already, such as a servo's 0 to 180 degrees
  move,  // the physical stops stay: the limits get the machine's values at the stops of the model's geometry
};

// The operations after which the model's position equals the machine's: FlipAxis if the direction is -1,
// BakeZero if the zero differs (R_new = R_old R_axis(-offset)), SetLimit according to `limits`. The scale
// cannot be represented in the geometry and has to be corrected in the driver.
DOPPEL_API std::vector<Operation> calibration_operations(const Joint& joint, const JointFit& fit,
                                                         std::span<const Measurement> measurements,
                                                         LimitChoice limits);

// The index of an existing correction that was made from the same measurements. A measurement refers to the
// model at the time of measuring, so that using it again would apply the correction twice. `corrections`:
// those of the overlay. A correction of the joint matches if it was made from one of these measurements, or
// if it flips the axis or moves the zero by the same amount again.
DOPPEL_API std::optional<std::size_t> correction_made_of(const std::vector<Operation>& corrections,
                                                         const std::string& joint,
                                                         const std::vector<Operation>& fresh);
// The indices of the joint's corrections of direction and zero, from any source; joints by their last names.
DOPPEL_API std::vector<std::size_t> zeros_of(const std::vector<Operation>& corrections,
                                             const std::string& joint);

// -- measurements as text
struct NamedMeasurements {
  std::string joint;
  std::vector<Measurement> measurements;
};
// One number of a measurement; nullopt if the text is not a number.
DOPPEL_API std::optional<double> measured_number(std::string_view text);
// "Revolute 2: 0=45 90=135": model=machine, in degrees for revolute joints, in millimetres for prismatic
// ones; the result is in rad and m. Throws InputError for text of another form, and for a joint that the
// robot does not have, with the nearest name.
DOPPEL_API NamedMeasurements parse_measurements(const std::string& text, const RobotDescription& robot);

}  // namespace doppel
