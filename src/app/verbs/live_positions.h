#pragma once
// Positions of joints as a machine reports them now, for a calibration: from the robot that runs (doppel up),
// or from its servos where nothing runs.

#include <memory>
#include <string>
#include <vector>

#include "app/verbs/hardware_target.h"

namespace doppel::app {

class LivePositions {
 public:
  virtual ~LivePositions() = default;

  // "the servos on /dev/ttyUSB0"
  [[nodiscard]] virtual std::string source() const = 0;
  [[nodiscard]] virtual std::vector<std::string> joints() const = 0;
  // rad or m, of a joint at rest: the mean of some samples that agree. Throws InputError: the joint moves, or
  // nothing is reported.
  virtual double position(const std::string& joint) = 0;
};

// `options.port`: a number is that of a running robot's server, a path that of the servos. Empty: the servos'
// port of the description, unless a running doppel has it open, or no servo reports anything; then that
// robot. From servos that are opened here the torque is taken, after a question; the arm is then moved by
// hand. `yes`: the question is answered. nullptr: the answer was no. Throws InputError and ClientError.
std::unique_ptr<LivePositions> open_live_positions(const HardwareOptions& options, bool yes);

}  // namespace doppel::app
