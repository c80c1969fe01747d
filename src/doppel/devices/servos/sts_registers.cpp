// STS3215's registers and their values as delivered, by the names of LeRobot's table of the STS and SMS
// series.
#include <array>

#include "doppel/devices/servos/detail/register_tables.h"

namespace doppel {
namespace {

using enum RegisterSign;

constexpr std::array kRegisters{
    ServoRegister{"Firmware_Major_Version", 0, 1, kEeprom, kReadOnly, 3},
    ServoRegister{"Firmware_Minor_Version", 1, 1, kEeprom, kReadOnly, 10},
    ServoRegister{"Model_Number", 3, 2, kEeprom, kReadOnly, 777},
    ServoRegister{"ID", 5, 1, kEeprom, kWritable, 1},
    ServoRegister{"Baud_Rate", 6, 1, kEeprom, kWritable, 0},
    ServoRegister{"Return_Delay_Time", 7, 1, kEeprom, kWritable, 250},
    ServoRegister{"Response_Status_Level", 8, 1, kEeprom, kWritable, 1},
    ServoRegister{"Min_Position_Limit", 9, 2, kEeprom, kWritable, 0},
    ServoRegister{"Max_Position_Limit", 11, 2, kEeprom, kWritable, 4095},
    ServoRegister{"Max_Temperature_Limit", 13, 1, kEeprom, kWritable, 70},
    ServoRegister{"Max_Voltage_Limit", 14, 1, kEeprom, kWritable, 80},
    ServoRegister{"Min_Voltage_Limit", 15, 1, kEeprom, kWritable, 40},
    ServoRegister{"Max_Torque_Limit", 16, 2, kEeprom, kWritable, 1000},
    ServoRegister{"Phase", 18, 1, kEeprom, kWritable, 12},
    ServoRegister{"Unloading_Condition", 19, 1, kEeprom, kWritable, 44},
    ServoRegister{"LED_Alarm_Condition", 20, 1, kEeprom, kWritable, 47},
    ServoRegister{"P_Coefficient", 21, 1, kEeprom, kWritable, 32},
    ServoRegister{"D_Coefficient", 22, 1, kEeprom, kWritable, 32},
    ServoRegister{"I_Coefficient", 23, 1, kEeprom, kWritable, 0},
    ServoRegister{"Minimum_Startup_Force", 24, 2, kEeprom, kWritable, 16},
    ServoRegister{"CW_Dead_Zone", 26, 1, kEeprom, kWritable, 1},
    ServoRegister{"CCW_Dead_Zone", 27, 1, kEeprom, kWritable, 1},
    ServoRegister{"Protection_Current", 28, 2, kEeprom, kWritable, 500},
    ServoRegister{"Angular_Resolution", 30, 1, kEeprom, kWritable, 1},
    ServoRegister{"Homing_Offset", 31, 2, kEeprom, kWritable, 0, bit_11},
    ServoRegister{"Operating_Mode", 33, 1, kEeprom, kWritable, 0},
    ServoRegister{"Protective_Torque", 34, 1, kEeprom, kWritable, 20},
    ServoRegister{"Protection_Time", 35, 1, kEeprom, kWritable, 200},
    ServoRegister{"Overload_Torque", 36, 1, kEeprom, kWritable, 80},
    ServoRegister{"Velocity_closed_loop_P_proportional_coefficient", 37, 1, kEeprom, kWritable, 10},
    ServoRegister{"Over_Current_Protection_Time", 38, 1, kEeprom, kWritable, 200},
    ServoRegister{"Velocity_closed_loop_I_integral_coefficient", 39, 1, kEeprom, kWritable, 200},
    ServoRegister{"Torque_Enable", 40, 1, kRam, kWritable, 0},
    ServoRegister{"Acceleration", 41, 1, kRam, kWritable, 0},
    ServoRegister{"Goal_Position", 42, 2, kRam, kWritable, 0, bit_15},
    ServoRegister{"Goal_Time", 44, 2, kRam, kWritable, 0},
    ServoRegister{"Goal_Velocity", 46, 2, kRam, kWritable, 0, bit_15},
    ServoRegister{"Torque_Limit", 48, 2, kRam, kWritable, 1000},
    ServoRegister{"Lock", 55, 1, kRam, kWritable, 1},
    ServoRegister{"Present_Position", 56, 2, kRam, kReadOnly, 2048, bit_15},
    ServoRegister{"Present_Velocity", 58, 2, kRam, kReadOnly, 0, bit_15},
    ServoRegister{"Present_Load", 60, 2, kRam, kReadOnly, 0, bit_10},
    ServoRegister{"Present_Voltage", 62, 1, kRam, kReadOnly, 74},
    ServoRegister{"Present_Temperature", 63, 1, kRam, kReadOnly, 25},
    ServoRegister{"Status", 65, 1, kRam, kReadOnly, 0},
    ServoRegister{"Moving", 66, 1, kRam, kReadOnly, 0},
    ServoRegister{"Present_Current", 69, 2, kRam, kReadOnly, 0, bit_15},
    ServoRegister{"Maximum_Velocity_Limit", 84, 1, kEeprom, kWritable, 0},
    ServoRegister{"Maximum_Acceleration", 85, 1, kEeprom, kWritable, 254},
    ServoRegister{"Acceleration_Multiplier", 86, 1, kEeprom, kWritable, 1},
};

using Role = std::pair<ServoRole, std::string_view>;
constexpr std::array kRoles{
    Role{ServoRole::id, "ID"},
    Role{ServoRole::baud_rate, "Baud_Rate"},
    Role{ServoRole::return_delay, "Return_Delay_Time"},
    Role{ServoRole::firmware, "Firmware_Major_Version"},
    Role{ServoRole::torque_enable, "Torque_Enable"},
    Role{ServoRole::lock, "Lock"},
    Role{ServoRole::operating_mode, "Operating_Mode"},
    Role{ServoRole::homing_offset, "Homing_Offset"},
    Role{ServoRole::min_position, "Min_Position_Limit"},
    Role{ServoRole::max_position, "Max_Position_Limit"},
    Role{ServoRole::torque_limit, "Torque_Limit"},
    Role{ServoRole::position_gain, "P_Coefficient"},
    Role{ServoRole::goal_position, "Goal_Position"},
    Role{ServoRole::goal_velocity, "Goal_Velocity"},
    Role{ServoRole::goal_acceleration, "Acceleration"},
    Role{ServoRole::present_position, "Present_Position"},
    Role{ServoRole::present_velocity, "Present_Velocity"},
    Role{ServoRole::present_load, "Present_Load"},
    Role{ServoRole::present_current, "Present_Current"},
    Role{ServoRole::present_voltage, "Present_Voltage"},
    Role{ServoRole::present_temperature, "Present_Temperature"},
    Role{ServoRole::errors, "Status"},
    Role{ServoRole::moving, "Moving"},
};

constexpr std::array<std::pair<int, int>, 8> kRates{
    {{0, 1000000}, {1, 500000}, {2, 250000}, {3, 128000}, {4, 115200}, {5, 76800}, {6, 57600}, {7, 38400}}};

}  // namespace

std::span<const ServoRegister> sts_registers() {
  return kRegisters;
}
RoleTable sts_roles() {
  return kRoles;
}
std::span<const std::pair<int, int>> sts_baud_rates() {
  return kRates;
}

}  // namespace doppel
