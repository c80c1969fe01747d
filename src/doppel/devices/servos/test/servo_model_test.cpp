#include "doppel/devices/servos/servo_model.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

namespace doppel {
namespace {

TEST(ServoModels, RegistersDoNotOverlapAndRolesExist) {
  for (const ServoModel& model : servo_models()) {
    std::set<int> used;
    for (const ServoRegister& one : model.registers) {
      for (int i = 0; i < one.size; ++i)
        EXPECT_TRUE(used.insert(one.address + i).second) << model.name << ": " << one.name;
    }
    for (const auto& [role, name] : model.roles)
      EXPECT_NE(model.find(role), nullptr) << model.name << ": " << name;
    EXPECT_GT(model.stall_torque, 0) << model.name;
    EXPECT_TRUE(model.rate_of(model.default_baud_index)) << model.name;
  }
}

TEST(ServoModels, CyclicBlocksAreThoseOfProtocolTable) {
  const ServoModel& sts = *find_servo_model("sts3215");
  EXPECT_EQ(sts.find(ServoRole::goal_position)->address, 42);
  EXPECT_EQ(sts.find(ServoRole::present_position)->address, 56);
  const ServoModel& xl = *find_servo_model("XL430-W250");
  EXPECT_EQ(xl.find(ServoRole::goal_position)->address, 116);
  EXPECT_EQ(xl.find(ServoRole::present_load)->address, 126);
  EXPECT_EQ(find_servo_model(ServoProtocol::feetech, 777), &sts);
}

TEST(ServoModels, EveryValueComesBackFromItsBytes) {
  for (const ServoModel& model : servo_models()) {
    for (const ServoRegister& one : model.registers) {
      const bool has_sign = one.sign != RegisterSign::none;
      for (const std::int64_t value : {0, 1, 37, 100, has_sign ? -1 : 1, has_sign ? -100 : 2}) {
        std::array<std::uint8_t, 8> bytes{};
        encode_register(one, value, bytes);
        EXPECT_EQ(decode_register(one, bytes), value) << model.name << ": " << one.name;
      }
    }
  }
}

TEST(ServoModels, SignBitsAreThoseOfMaker) {
  const ServoModel& sts = *find_servo_model("STS3215");
  std::array<std::uint8_t, 2> bytes{};
  encode_register(*sts.find("Homing_Offset"), -5, bytes);
  EXPECT_EQ(bytes[0] | (bytes[1] << 8), 0x0805);
  encode_register(*sts.find("Present_Load"), -300, bytes);
  EXPECT_EQ(bytes[0] | (bytes[1] << 8), 0x0400 | 300);
  encode_register(*sts.find("Present_Velocity"), -300, bytes);
  EXPECT_EQ(bytes[0] | (bytes[1] << 8), 0x8000 | 300);
}

TEST(ServoModels, AngleOfTicksIsZeroInCentre) {
  const ServoModel& sts = *find_servo_model("STS3215");
  EXPECT_DOUBLE_EQ(sts.angle(2048), 0);
  EXPECT_DOUBLE_EQ(sts.angle(3072), std::numbers::pi / 2);
  EXPECT_NEAR(sts.ticks(sts.angle(17)), 17, 1e-9);
}

TEST(ServoModels, ErrorBitsAreNamed) {
  const ServoModel& sts = *find_servo_model("STS3215");
  EXPECT_EQ(sts.faults(0x20), kOverloadFault);
  EXPECT_EQ(sts.faults(0x05), kVoltageFault | kTemperatureFault);
  EXPECT_EQ(find_servo_model("xl430-w250")->faults(0x20), kOverloadFault);
}

}  // namespace
}  // namespace doppel
