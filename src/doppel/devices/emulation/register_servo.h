#pragma once
// One emulated servo: a table of registers with the rules of its maker, and what the registers do to its
// motor.
//
// Feetech: EEPROM registers are writable while the lock (55) is 0; Present = Actual - Homing_Offset;
// writing 128 to Torque_Enable makes the present position the middle. Dynamixel: EEPROM registers are
// writable while the torque is off; the bus watchdog counts 20 ms units. Goals are kept within the position
// limits, at most at the goal speed, with at most the torque limit of the stall torque. A load above the
// protection's threshold for its time latches: the torque is off until the servo restarts. Heat: a
// first-order model from the square of the load.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/devices/emulation/device_emulator.h"
#include "doppel/devices/servos/servo_model.h"
#include "doppel/export.h"

namespace doppel {

// Dynamixel's errors in answers.
enum class AccessError : std::uint8_t {
  none = 0,
  instruction = 2,
  range = 4,
  length = 5,
  limit = 6,
  access = 7
};

class DOPPEL_API RegisterServo {
 public:
  RegisterServo(const ServoModel& model, int id);

  [[nodiscard]] const ServoModel& model() const { return *model_; }
  [[nodiscard]] int id() const;
  [[nodiscard]] int rate() const;  // bit/s

  // The value of a register by its role or name. Preconditions: the model has it.
  [[nodiscard]] std::int64_t value(ServoRole role) const;
  [[nodiscard]] std::int64_t value(std::string_view name) const;
  // Sets it whatever the rules, as in the factory. Precondition: the model has it.
  void set(ServoRole role, std::int64_t value);
  void set(std::string_view name, std::int64_t value);

  // -- by the host
  // The bytes at an address; empty: beyond the table.
  [[nodiscard]] std::span<const std::uint8_t> bytes(std::size_t address, std::size_t size) const;
  // Writes what the rules permit; the error of the first register that they do not.
  AccessError write(std::size_t address, std::span<const std::uint8_t> bytes);
  // Keeps a write for the next action, in place of the one before.
  void keep_write(std::size_t address, std::span<const std::uint8_t> bytes);
  AccessError do_kept_write();  // none: there is none
  // Every frame that the servo has seen feeds its watchdog.
  void notice_host(Time now) { host_seen_ = now; }
  void set_supply(double volts) { supply_ = volts; }
  // Power off and on: the RAM is as delivered, the torque is off, a latch is gone.
  void restart();
  // The error byte of an answer.
  [[nodiscard]] std::uint8_t error_byte(AccessError access) const;
  [[nodiscard]] Duration return_delay() const;
  [[nodiscard]] bool answers_writes() const;

  // -- by the motor
  // `slip`: the horn has turned against the shaft, rad; `flipped`: it counts the other way.
  struct Disturbance {
    bool stuck = false, flipped = false;
    double slip = 0;
    std::optional<double> temperature = {};
    bool overload = false;
  };
  void step(Time now, Duration period, const MotorState& state, const Disturbance& disturbance,
            MotorDrive& drive);

 private:
  [[nodiscard]] std::int64_t raw(const ServoRegister& which) const;
  void put(const ServoRegister& which, std::int64_t value);
  [[nodiscard]] AccessError check(const ServoRegister& which, std::int64_t value) const;
  void written(const ServoRegister& which);
  void show_kept_write();
  void guard_load(double load, Duration period, bool overload);
  void guard_silence(Time now);
  void report(const MotorState& state, double load, Duration period, std::optional<double> temperature);
  void set_error(int bit, bool on);
  [[nodiscard]] std::int64_t position_limit(ServoRole role) const;

  const ServoModel* model_;
  std::vector<std::uint8_t> table_;
  std::size_t kept_address_ = 0;
  std::vector<std::uint8_t> kept_write_;  // empty: none
  std::optional<double> blocked_;         // rad, of the motor, since a fault blocks it
  double goal_shaft_ = 0;                 // rad, as the servo counts
  std::int64_t actual_ = 0;               // ticks, without the homing offset
  double temperature_;                    // degrees Celsius
  double supply_;                         // V, without a load
  Duration overloaded_{};                 // how long the load has been above the threshold
  bool latched_ = false;
  bool silenced_ = false;  // by the bus watchdog
  std::int64_t held_ = 0;  // ticks, the goal since the watchdog has stopped it
  Time host_seen_{};
};

}  // namespace doppel
