#include "doppel/devices/servos/servo_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "doppel/devices/servos/detail/register_tables.h"

namespace doppel {
namespace {

constexpr double kRpm = 2 * std::numbers::pi / 60;     // rad/s
constexpr double kTick = 2 * std::numbers::pi / 4096;  // rad
constexpr double kKilogramCentimetre = 0.0980665;      // N m
constexpr std::uint16_t kSts3215 = 777, kXl330 = 1200, kXl430 = 1060, kXm430 = 1020;

// Stall torques, speeds and currents are those of the data sheets at the rated voltage.
ServoModel sts3215() {
  ServoModel out;
  out.name = "STS3215";
  out.protocol = ServoProtocol::feetech;
  out.number = kSts3215;
  out.registers = sts_registers();
  out.roles = sts_roles();
  out.velocity_unit = kTick;  // ticks per second
  out.load_unit = 0.001;
  out.current_unit = 0.0065;
  out.voltage_unit = 0.1;
  out.whole_torque = 1000;
  out.min_voltage = 4.0;
  out.max_voltage = 8.4;
  out.rated_voltage = 7.4;
  out.stall_torque = 19.5 * kKilogramCentimetre;
  out.no_load_speed = 52 * kRpm;
  out.stall_current = 2.5;
  out.baud_rates = sts_baud_rates();
  return out;
}

ServoModel x_series(std::string_view name, std::uint16_t number, bool has_current) {
  ServoModel out;
  out.name = name;
  out.protocol = ServoProtocol::dynamixel;
  out.number = number;
  out.registers = has_current ? x_registers_with_current() : x_registers_with_load();
  out.roles = has_current ? x_roles_with_current() : x_roles_with_load();
  out.velocity_unit = 0.229 * kRpm;
  out.load_unit = has_current ? 0 : 0.001;
  out.voltage_unit = 0.1;
  out.whole_torque = 885;  // of the PWM limit
  out.position_mode = 3;
  out.default_baud_index = 1;
  out.baud_rates = x_baud_rates();
  return out;
}

ServoModel xl330() {
  ServoModel out = x_series("XL330-M288", kXl330, true);
  out.current_unit = 0.001;
  out.min_voltage = 3.7;
  out.max_voltage = 6.0;
  out.rated_voltage = 5.0;
  out.stall_torque = 0.52;
  out.no_load_speed = 103 * kRpm;
  out.stall_current = 1.47;
  return out;
}

ServoModel xl430() {
  ServoModel out = x_series("XL430-W250", kXl430, false);
  out.min_voltage = 6.5;
  out.max_voltage = 12.0;
  out.rated_voltage = 11.1;
  out.stall_torque = 1.4;
  out.no_load_speed = 57 * kRpm;
  out.stall_current = 1.3;
  return out;
}

ServoModel xm430() {
  ServoModel out = x_series("XM430-W350", kXm430, true);
  out.current_unit = 0.00269;
  out.min_voltage = 10.0;
  out.max_voltage = 14.8;
  out.rated_voltage = 12.0;
  out.stall_torque = 4.1;
  out.no_load_speed = 46 * kRpm;
  out.stall_current = 2.3;
  return out;
}

const std::array<ServoModel, 4>& table() {
  static const std::array<ServoModel, 4> models{sts3215(), xl330(), xl430(), xm430()};
  return models;
}

bool equal_names(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(a, b, {}, lower, lower);
}

}  // namespace

std::string_view to_string(ServoProtocol protocol) {
  switch (protocol) {
    case ServoProtocol::feetech:
      return "feetech";
    case ServoProtocol::dynamixel:
      return "dynamixel";
    case ServoProtocol::servo_line:
      break;
  }
  return "servo_line";
}

std::string_view fault_word(ServoFault fault) {
  switch (fault) {
    case kVoltageFault:
      return "supply voltage";
    case kSensorFault:
      return "position sensor";
    case kTemperatureFault:
      return "temperature";
    case kCurrentFault:
      return "current";
    case kOverloadFault:
      return "overload";
    case kMotorFault:
      break;
  }
  return "motor";
}

const ServoRegister* ServoModel::find(std::string_view register_name) const {
  const auto found = std::ranges::find(registers, register_name, &ServoRegister::name);
  return found == registers.end() ? nullptr : &*found;
}

const ServoRegister* ServoModel::find(ServoRole role) const {
  const auto found = std::ranges::find(roles, role, &std::pair<ServoRole, std::string_view>::first);
  return found == roles.end() ? nullptr : find(found->second);
}

double ServoModel::tick_angle() const {
  return 2 * std::numbers::pi / static_cast<double>(ticks_per_turn);
}

double ServoModel::angle(std::int64_t ticks) const {
  return static_cast<double>(ticks - centre) * tick_angle();
}

double ServoModel::ticks(double angle) const {
  return static_cast<double>(centre) + angle / tick_angle();
}

unsigned ServoModel::faults(std::int64_t error_register) const {
  struct Bit {
    unsigned bit;
    unsigned fault;
  };
  static constexpr std::array<Bit, 5> kFeetech{{{0, kVoltageFault},
                                                {1, kSensorFault},
                                                {2, kTemperatureFault},
                                                {3, kCurrentFault},
                                                {5, kOverloadFault}}};
  static constexpr std::array<Bit, 5> kDynamixel{
      {{0, kVoltageFault}, {2, kTemperatureFault}, {3, kSensorFault}, {4, kMotorFault}, {5, kOverloadFault}}};
  unsigned out = 0;
  for (const Bit& one : protocol == ServoProtocol::feetech ? kFeetech : kDynamixel) {
    if (((error_register >> one.bit) & 1) != 0) out |= one.fault;
  }
  return out;
}

std::optional<int> ServoModel::rate_of(std::int64_t value) const {
  for (const auto& [index, rate] : baud_rates) {
    if (index == value) return rate;
  }
  return {};
}

std::span<const ServoModel> servo_models() {
  return table();
}

const ServoModel* find_servo_model(ServoProtocol protocol, std::uint16_t number) {
  const auto found = std::ranges::find_if(
      table(), [&](const ServoModel& one) { return one.protocol == protocol && one.number == number; });
  return found == table().end() ? nullptr : &*found;
}

const ServoModel* find_servo_model(std::string_view name) {
  const auto found =
      std::ranges::find_if(table(), [&](const ServoModel& one) { return equal_names(one.name, name); });
  return found == table().end() ? nullptr : &*found;
}

}  // namespace doppel
