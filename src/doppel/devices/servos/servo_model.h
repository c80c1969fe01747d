#pragma once
// Servos with a bus, by their makers' register tables: STS3215 of Feetech ("ST3215 memory table", and the
// tables of the makers' SDK), X series of Robotis (emanual.robotis.com: XL330-M288, XL430-W250,
// XM430-W350).

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "doppel/export.h"

namespace doppel {

enum class ServoProtocol { servo_line, feetech, dynamixel };
[[nodiscard]] DOPPEL_API std::string_view to_string(ServoProtocol protocol);  // "feetech"

// How a register holds negative values.
enum class RegisterSign : std::uint8_t {
  none,
  twos_complement,
  bit_10,  // the sign is a bit of its own, the lower bits the magnitude
  bit_11,
  bit_15,
};

struct ServoRegister {
  std::string_view name;  // "Goal_Position"
  std::uint16_t address = 0;
  std::uint8_t size = 1;  // bytes, little endian
  bool eeprom =
      false;  // kept without power; written only while the torque is off (and unlocked, with Feetech)
  bool writable = false;
  std::int64_t initial = 0;  // as delivered
  RegisterSign sign = RegisterSign::none;
};

// The registers that a driver uses, whatever a maker calls them.
enum class ServoRole : std::uint8_t {
  id,
  baud_rate,
  return_delay,
  firmware,
  torque_enable,
  lock,  // Feetech: 0 permits writing to the EEPROM
  operating_mode,
  homing_offset,
  min_position,
  max_position,
  torque_limit,  // of now: a share of the stall torque, or a current
  position_gain,
  goal_position,
  goal_velocity,  // the speed of a move to a goal; 0: the fastest
  goal_acceleration,
  watchdog,  // Dynamixel: the bus watchdog
  present_position,
  present_velocity,
  present_load,
  present_current,
  present_voltage,
  present_temperature,
  errors,  // of the hardware
  moving,
};

// Faults that a servo reports, in any protocol.
enum ServoFault : unsigned {
  kVoltageFault = 1,
  kSensorFault = 2,
  kTemperatureFault = 4,
  kCurrentFault = 8,
  kOverloadFault = 16,
  kMotorFault = 32,
};
// "overload".
[[nodiscard]] DOPPEL_API std::string_view fault_word(ServoFault fault);

struct DOPPEL_API ServoModel {
  std::string_view name;  // "STS3215"
  ServoProtocol protocol = ServoProtocol::feetech;
  std::uint16_t number = 0;  // in its register of the model
  std::span<const ServoRegister> registers;
  std::span<const std::pair<ServoRole, std::string_view>> roles;

  std::int64_t ticks_per_turn = 4096;
  std::int64_t centre = 2048;               // ticks at the angle 0
  double velocity_unit = 0;                 // rad/s
  double load_unit = 0;                     // share of the stall torque; 0: it reports a current instead
  double current_unit = 0;                  // A; 0: it reports none
  double voltage_unit = 0.1;                // V
  std::int64_t whole_torque = 1000;         // of the register of the torque limit: the whole torque
  double min_voltage = 0, max_voltage = 0;  // V, of its supply
  double stall_torque = 0;                  // N m, at `rated_voltage`
  double no_load_speed = 0;                 // rad/s, the same
  double stall_current = 0;                 // A, the same
  double rated_voltage = 0;                 // V
  std::int64_t position_mode = 0;           // of the register of the operating mode
  std::int64_t default_baud_index = 0;
  std::span<const std::pair<int, int>> baud_rates;  // value of the register, bit/s

  [[nodiscard]] const ServoRegister* find(std::string_view register_name) const;  // nullptr: it has none
  [[nodiscard]] const ServoRegister* find(ServoRole role) const;                  // nullptr: it has none
  // Angles at the servo's shaft, rad, counter-clockwise seen at the horn is positive as in its ticks.
  [[nodiscard]] double angle(std::int64_t ticks) const;
  [[nodiscard]] double ticks(double angle) const;                    // not rounded
  [[nodiscard]] double tick_angle() const;                           // rad of one tick
  [[nodiscard]] unsigned faults(std::int64_t error_register) const;  // ServoFault bits
  // bit/s of a value of its register of the rate; nullopt: it is none.
  [[nodiscard]] std::optional<int> rate_of(std::int64_t value) const;
};

[[nodiscard]] DOPPEL_API std::span<const ServoModel> servo_models();
// nullptr: not known.
[[nodiscard]] DOPPEL_API const ServoModel* find_servo_model(ServoProtocol protocol, std::uint16_t number);
[[nodiscard]] DOPPEL_API const ServoModel* find_servo_model(std::string_view name);  // in any case, "sts3215"

// A register's value from its bytes and into them.
[[nodiscard]] DOPPEL_API std::int64_t decode_register(const ServoRegister& which,
                                                      std::span<const std::uint8_t> bytes);
DOPPEL_API void encode_register(const ServoRegister& which, std::int64_t value,
                                std::span<std::uint8_t> bytes);

}  // namespace doppel
