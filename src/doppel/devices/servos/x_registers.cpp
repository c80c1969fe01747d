// The control table of Dynamixel's X series, and its values as delivered (those of the XL430-W250).
#include <algorithm>
#include <array>

#include "doppel/devices/servos/detail/register_tables.h"

namespace doppel {
namespace {

using enum RegisterSign;

constexpr std::array kCommon{
    ServoRegister{"Model_Number", 0, 2, kEeprom, kReadOnly, 1060},
    ServoRegister{"Model_Information", 2, 4, kEeprom, kReadOnly, 0},
    ServoRegister{"Firmware_Version", 6, 1, kEeprom, kReadOnly, 45},
    ServoRegister{"ID", 7, 1, kEeprom, kWritable, 1},
    ServoRegister{"Baud_Rate", 8, 1, kEeprom, kWritable, 1},
    ServoRegister{"Return_Delay_Time", 9, 1, kEeprom, kWritable, 250},
    ServoRegister{"Drive_Mode", 10, 1, kEeprom, kWritable, 0},
    ServoRegister{"Operating_Mode", 11, 1, kEeprom, kWritable, 3},
    ServoRegister{"Secondary_ID", 12, 1, kEeprom, kWritable, 255},
    ServoRegister{"Protocol_Type", 13, 1, kEeprom, kWritable, 2},
    ServoRegister{"Homing_Offset", 20, 4, kEeprom, kWritable, 0, twos_complement},
    ServoRegister{"Moving_Threshold", 24, 4, kEeprom, kWritable, 10},
    ServoRegister{"Temperature_Limit", 31, 1, kEeprom, kWritable, 72},
    ServoRegister{"Max_Voltage_Limit", 32, 2, kEeprom, kWritable, 140},
    ServoRegister{"Min_Voltage_Limit", 34, 2, kEeprom, kWritable, 60},
    ServoRegister{"PWM_Limit", 36, 2, kEeprom, kWritable, 885},
    ServoRegister{"Velocity_Limit", 44, 4, kEeprom, kWritable, 265},
    ServoRegister{"Max_Position_Limit", 48, 4, kEeprom, kWritable, 4095, twos_complement},
    ServoRegister{"Min_Position_Limit", 52, 4, kEeprom, kWritable, 0, twos_complement},
    ServoRegister{"Shutdown", 63, 1, kEeprom, kWritable, 52},
    ServoRegister{"Torque_Enable", 64, 1, kRam, kWritable, 0},
    ServoRegister{"LED", 65, 1, kRam, kWritable, 0},
    ServoRegister{"Status_Return_Level", 68, 1, kRam, kWritable, 2},
    ServoRegister{"Registered_Instruction", 69, 1, kRam, kReadOnly, 0},
    ServoRegister{"Hardware_Error_Status", 70, 1, kRam, kReadOnly, 0},
    ServoRegister{"Velocity_I_Gain", 76, 2, kRam, kWritable, 1000},
    ServoRegister{"Velocity_P_Gain", 78, 2, kRam, kWritable, 100},
    ServoRegister{"Position_D_Gain", 80, 2, kRam, kWritable, 4000},
    ServoRegister{"Position_I_Gain", 82, 2, kRam, kWritable, 0},
    ServoRegister{"Position_P_Gain", 84, 2, kRam, kWritable, 640},
    ServoRegister{"Feedforward_2nd_Gain", 88, 2, kRam, kWritable, 0},
    ServoRegister{"Feedforward_1st_Gain", 90, 2, kRam, kWritable, 0},
    ServoRegister{"Bus_Watchdog", 98, 1, kRam, kWritable, 0, twos_complement},
    ServoRegister{"Goal_PWM", 100, 2, kRam, kWritable, 885, twos_complement},
    ServoRegister{"Goal_Velocity", 104, 4, kRam, kWritable, 0, twos_complement},
    ServoRegister{"Profile_Acceleration", 108, 4, kRam, kWritable, 0},
    ServoRegister{"Profile_Velocity", 112, 4, kRam, kWritable, 0},
    ServoRegister{"Goal_Position", 116, 4, kRam, kWritable, 0, twos_complement},
    ServoRegister{"Realtime_Tick", 120, 2, kRam, kReadOnly, 0},
    ServoRegister{"Moving", 122, 1, kRam, kReadOnly, 0},
    ServoRegister{"Moving_Status", 123, 1, kRam, kReadOnly, 0},
    ServoRegister{"Present_PWM", 124, 2, kRam, kReadOnly, 0, twos_complement},
    ServoRegister{"Present_Velocity", 128, 4, kRam, kReadOnly, 0, twos_complement},
    ServoRegister{"Present_Position", 132, 4, kRam, kReadOnly, 2048, twos_complement},
    ServoRegister{"Velocity_Trajectory", 136, 4, kRam, kReadOnly, 0, twos_complement},
    ServoRegister{"Position_Trajectory", 140, 4, kRam, kReadOnly, 0, twos_complement},
    ServoRegister{"Present_Input_Voltage", 144, 2, kRam, kReadOnly, 110},
    ServoRegister{"Present_Temperature", 146, 1, kRam, kReadOnly, 25},
};
constexpr std::array kOfLoad{
    ServoRegister{"Present_Load", 126, 2, kRam, kReadOnly, 0, twos_complement},
};
constexpr std::array kOfCurrent{
    ServoRegister{"Current_Limit", 38, 2, kEeprom, kWritable, 1193},
    ServoRegister{"Goal_Current", 102, 2, kRam, kWritable, 1193, twos_complement},
    ServoRegister{"Present_Current", 126, 2, kRam, kReadOnly, 0, twos_complement},
};

template <std::size_t A, std::size_t B>
constexpr auto joined(const std::array<ServoRegister, A>& a, const std::array<ServoRegister, B>& b) {
  std::array<ServoRegister, A + B> out{};
  std::ranges::copy(a, out.begin());
  std::ranges::copy(b, out.begin() + A);
  std::ranges::sort(out, {}, &ServoRegister::address);
  return out;
}
constexpr auto kWithLoad = joined(kCommon, kOfLoad);
constexpr auto kWithCurrent = joined(kCommon, kOfCurrent);

using Role = std::pair<ServoRole, std::string_view>;
constexpr std::array kLoadRoles{
    Role{ServoRole::present_load, "Present_Load"},
    Role{ServoRole::id, "ID"},
    Role{ServoRole::baud_rate, "Baud_Rate"},
    Role{ServoRole::return_delay, "Return_Delay_Time"},
    Role{ServoRole::firmware, "Firmware_Version"},
    Role{ServoRole::torque_enable, "Torque_Enable"},
    Role{ServoRole::operating_mode, "Operating_Mode"},
    Role{ServoRole::homing_offset, "Homing_Offset"},
    Role{ServoRole::min_position, "Min_Position_Limit"},
    Role{ServoRole::max_position, "Max_Position_Limit"},
    Role{ServoRole::torque_limit, "Goal_PWM"},
    Role{ServoRole::position_gain, "Position_P_Gain"},
    Role{ServoRole::goal_position, "Goal_Position"},
    Role{ServoRole::goal_velocity, "Profile_Velocity"},
    Role{ServoRole::goal_acceleration, "Profile_Acceleration"},
    Role{ServoRole::watchdog, "Bus_Watchdog"},
    Role{ServoRole::present_position, "Present_Position"},
    Role{ServoRole::present_velocity, "Present_Velocity"},
    Role{ServoRole::present_voltage, "Present_Input_Voltage"},
    Role{ServoRole::present_temperature, "Present_Temperature"},
    Role{ServoRole::errors, "Hardware_Error_Status"},
    Role{ServoRole::moving, "Moving"},
};
constexpr auto kCurrentRoles = [] {
  auto out = kLoadRoles;
  out.front() = Role{ServoRole::present_current, "Present_Current"};
  return out;
}();

constexpr std::array<std::pair<int, int>, 8> kXRates{{{0, 9600},
                                                      {1, 57600},
                                                      {2, 115200},
                                                      {3, 1000000},
                                                      {4, 2000000},
                                                      {5, 3000000},
                                                      {6, 4000000},
                                                      {7, 4500000}}};

}  // namespace

std::span<const ServoRegister> x_registers_with_current() {
  return kWithCurrent;
}
std::span<const ServoRegister> x_registers_with_load() {
  return kWithLoad;
}
RoleTable x_roles_with_current() {
  return kCurrentRoles;
}
RoleTable x_roles_with_load() {
  return kLoadRoles;
}
std::span<const std::pair<int, int>> x_baud_rates() {
  return kXRates;
}

}  // namespace doppel
