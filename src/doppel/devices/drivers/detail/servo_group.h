#pragma once
// The servos of one component as its driver commands them, whatever their protocol; angles are those of the
// shafts.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/serial/byte_link.h"

namespace doppel {

class ServoGroup {
 public:
  virtual ~ServoGroup() = default;

  // -- between ticks; each may wait for answers Finds every servo and reads what it is. Nothing moves, and
  // no torque changes. Refused: what is wrong with which servo.
  virtual Status connect() = 0;
  // The torque of the enabled servos on, at `torque` of the stall torque, with their present positions as
  // goals, which are written and read back before. Refused: a goal is not where the servo is; all torque is
  // as it was.
  virtual Status start(double torque) = 0;
  // True: a servo holds its joint already, as after a host that was killed, or does not say whether it does.
  // May wait for answers.
  virtual bool has_torque() = 0;
  virtual Status relax() = 0;  // all torque off
  // The torque of one joint off; no goal is written to it until it is caught. Refused: not confirmed.
  virtual Status release(std::size_t /*joint*/) { return Status::refused("its servo has no torque switch"); }
  // A share of the stall torque. False: a servo has not confirmed it.
  virtual bool set_torque(double share) = 0;

  // -- the cycle, without allocation
  // The present position becomes the goal, and the torque is on again: the position (rad). nullopt: the
  // servo has not confirmed it, and its torque may be off.
  virtual std::optional<double> catch_joint(std::size_t /*joint*/) { return std::nullopt; }
  // How many readings are fresh.
  virtual std::size_t read(std::span<ServoReading> readings) = 0;
  // A goal without a position (NaN) is not written. False: the link is lost.
  virtual bool write(std::span<const ServoGoal> goals) = 0;

  // Why the device does not follow although it answers; empty: it follows.
  [[nodiscard]] virtual std::string_view refusal() const { return {}; }
  // True: positions are what the device was told, and no measurement.
  [[nodiscard]] virtual bool believes() const = 0;
  // False: the device reports no positions, and no person has confirmed its pose since it has power.
  [[nodiscard]] virtual bool knows_pose() const { return true; }
  // Between ticks: the joints are at these positions. Throws InputError: it cannot be recorded.
  virtual void take_pose(std::span<const std::pair<std::string, double>> /*positions*/) {}
  [[nodiscard]] virtual const BusCounts& counts() const = 0;
};

// `setup` and `link` outlive the group.
std::unique_ptr<ServoGroup> make_register_group(const ServoSetup& setup, ByteLink& link);
std::unique_ptr<ServoGroup> make_line_group(const ServoSetup& setup, ByteLink& link);

}  // namespace doppel
