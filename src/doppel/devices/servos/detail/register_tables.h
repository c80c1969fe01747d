#pragma once
// The makers' register tables.

#include <span>
#include <utility>

#include "doppel/devices/servos/servo_model.h"

namespace doppel {

inline constexpr bool kEeprom = true, kRam = false, kReadOnly = false, kWritable = true;

using RoleTable = std::span<const std::pair<ServoRole, std::string_view>>;

std::span<const ServoRegister> sts_registers();
RoleTable sts_roles();
std::span<const std::pair<int, int>> sts_baud_rates();

// The X series: models that measure the motor's current, and models that estimate its load by the PWM.
std::span<const ServoRegister> x_registers_with_current();
std::span<const ServoRegister> x_registers_with_load();
RoleTable x_roles_with_current();
RoleTable x_roles_with_load();
std::span<const std::pair<int, int>> x_baud_rates();

}  // namespace doppel
