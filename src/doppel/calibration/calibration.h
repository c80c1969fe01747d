#pragma once
// Direction, zero and scale of a joint from measurements: pairs of what the model says and what the machine
// says at the same pose. One measurement separates nothing; two that are at least 60 degrees apart fit a line
// machine = scale * model + offset, more give residuals.

#include <string>
#include <vector>

#include "doppel/description/robot_description.h"
#include "doppel/overlay/operation.h"

namespace doppel {

struct Measurement {
  double machine = 0;  // what the machine (the servo) says: rad or m
  double model = 0;    // what the uncorrected model has to be set to for the same pose: rad or m
};

struct JointCalibrationFit {
  std::string joint;
  int direction = 1;              // -1: the model turns the other way
  double offset = 0;              // machine's value where the (direction-corrected) model is zero; rad or m
  double scale = 1;               // machine per model, positive
  std::vector<double> residuals;  // rad or m, machine minus fit, of each measurement
};

}  // namespace doppel
