// The host's bus against emulated servos: two programs' halves of the makers' protocols, over bytes alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <variant>
#include <vector>

#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/emulation/board_emulator.h"
#include "doppel/devices/emulation/bus_emulator.h"
#include "doppel/devices/emulation/emulated_link.h"
#include "doppel/devices/emulation/test/endless_link.h"
#include "doppel/devices/emulation/test/test_machine.h"
#include "doppel/devices/frames/servo_line.h"

namespace doppel {
namespace {

using test::TestMachine;
using testing::ElementsAre;

constexpr int kRate = 1000000;

struct Bench {
  Bench(const char* model_name, std::size_t count, std::vector<EmulatedFault> faults = {})
      : model(*find_servo_model(model_name)),
        devices(model.protocol, servos_of(model, count), std::move(faults)),
        link(devices, "emulated", kRate),
        bus(link, model.protocol, kRate),
        machine(devices, count) {
    for (std::size_t i = 0; i < count; ++i) servos.push_back({static_cast<int>(i + 1), &model});
    machine.run(link, 0.01);
  }
  static std::vector<RegisterServo> servos_of(const ServoModel& model, std::size_t count) {
    std::vector<RegisterServo> out;
    for (std::size_t i = 0; i < count; ++i) {
      out.emplace_back(model, static_cast<int>(i + 1));
      // Both makers' third entries differ; the rate is 1 Mbit/s.
      out.back().set(ServoRole::baud_rate, model.protocol == ServoProtocol::feetech ? 0 : 3);
      out.back().set(ServoRole::return_delay, 0);
    }
    return out;
  }
  // The bytes that answer a frame within 50 ms.
  std::vector<std::uint8_t> answer_to(std::uint8_t id, std::uint8_t instruction,
                                      const std::vector<std::uint8_t>& parameters) {
    FrameBytes frame;
    if (model.protocol == ServoProtocol::feetech) {
      add_feetech_frame({id, instruction, parameters}, frame);
    } else {
      add_dynamixel_frame({id, instruction, parameters}, frame);
    }
    EXPECT_TRUE(link.write(frame.bytes()));
    std::vector<std::uint8_t> out;
    std::array<std::uint8_t, 256> bytes{};
    const Time deadline = link.now() + from_seconds(0.05);
    while (const std::size_t count = link.read(bytes, deadline))
      out.insert(out.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
    return out;
  }
  bool exchange(std::uint8_t id, std::uint8_t instruction, const std::vector<std::uint8_t>& parameters) {
    return !answer_to(id, instruction, parameters).empty();
  }
  bool set_torque(int id, bool on) {
    return bus.write(id, *model.find(ServoRole::torque_enable), on ? 1 : 0);
  }

  const ServoModel& model;
  BusEmulator devices;
  EmulatedLink link;
  ServoBus bus;
  TestMachine machine;
  std::vector<BusServo> servos;
};

// The status of a servo that no request was for.
std::vector<std::uint8_t> answer_of_stranger(ServoProtocol protocol) {
  constexpr std::uint8_t kStranger = 9;
  const std::array<std::uint8_t, 1> no_error{0};
  FrameBytes frame;
  if (protocol == ServoProtocol::feetech) {
    add_feetech_frame({kStranger, 0, {}}, frame);
  } else {
    add_dynamixel_frame({kStranger, static_cast<std::uint8_t>(DynamixelInstruction::status), no_error},
                        frame);
  }
  return {frame.bytes().begin(), frame.bytes().end()};
}

class EveryBus : public testing::TestWithParam<const char*> {};

TEST_P(EveryBus, ServosAnswerPing) {
  Bench bench(GetParam(), 3);
  for (int id = 1; id <= 3; ++id) {
    const auto answer = bench.bus.ping(id);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->number, bench.model.number);
  }
  EXPECT_FALSE(bench.bus.ping(4));
  EXPECT_EQ(bench.bus.ping_all().size(), 3U);
}

TEST_P(EveryBus, RegistersAreReadAndWritten) {
  Bench bench(GetParam(), 1);
  const ServoRegister& offset = *bench.model.find(ServoRole::homing_offset);
  if (bench.model.find(ServoRole::lock) != nullptr) {
    EXPECT_TRUE(bench.bus.write(1, offset, -5));
    EXPECT_EQ(bench.bus.read(1, offset), 0) << "the EEPROM is locked";
    EXPECT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::lock), 0));
  }
  EXPECT_TRUE(bench.bus.write(1, offset, -5));
  EXPECT_EQ(bench.bus.read(1, offset), -5);
  EXPECT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::present_position), 7));
  EXPECT_NE(bench.bus.read(1, *bench.model.find(ServoRole::present_position)), 7);
}

TEST_P(EveryBus, ChangedIdIsConfirmedByOldOne) {
  Bench bench(GetParam(), 1);
  if (bench.model.find(ServoRole::lock) != nullptr) {
    EXPECT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::lock), 0));
  }
  EXPECT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::id), 6));
  EXPECT_FALSE(bench.bus.ping(1));
  EXPECT_TRUE(bench.bus.ping(6));
}

TEST_P(EveryBus, CycleMovesServosToTheirGoals) {
  Bench bench(GetParam(), 3);
  bench.bus.begin_cycle(bench.servos, true);
  std::vector<ServoReading> readings(3);
  ASSERT_EQ(bench.bus.read_all(readings), 3U);
  for (const ServoReading& one : readings) EXPECT_NEAR(one.position, 0, 0.002);
  const std::vector<ServoGoal> goals{{0.5, 0}, {-0.5, 0}, {1.0, 0.5}};
  for (int id = 1; id <= 3; ++id) ASSERT_TRUE(bench.set_torque(id, true));
  ASSERT_TRUE(bench.bus.write_goals(goals));
  bench.machine.run(bench.link, 1.0);
  ASSERT_EQ(bench.bus.read_all(readings), 3U);
  EXPECT_NEAR(readings[0].position, 0.5, 0.002);
  EXPECT_NEAR(readings[1].position, -0.5, 0.002);
  if (bench.model.protocol == ServoProtocol::feetech) {
    EXPECT_NEAR(readings[2].position, 0.5, 0.01);
  }
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(bench.bus.read_health(readings));
  for (const ServoReading& one : readings) {
    EXPECT_NEAR(one.voltage, bench.model.rated_voltage, 0.3);
    EXPECT_NEAR(one.temperature, 25, 1);
    EXPECT_EQ(one.faults, 0U);
  }
}

TEST_P(EveryBus, DamagedAnswerKeepsOldReading) {
  Bench bench(GetParam(), 2);
  bench.bus.begin_cycle(bench.servos, false);
  std::vector<ServoReading> readings(2);
  ASSERT_EQ(bench.bus.read_all(readings), 2U);
  bench.machine.states[1].position = 0.3;
  bench.devices.add_fault({.kind = FaultKind::corrupt, .servo = 2, .begin = bench.machine.now});
  bench.machine.run(bench.link, 0.01);
  EXPECT_LT(bench.bus.read_all(readings), 2U);
  EXPECT_FALSE(readings[1].fresh);
  EXPECT_NEAR(readings[1].position, 0, 0.002);
  EXPECT_GE(bench.bus.counts().lost, 1U);
}

TEST_P(EveryBus, AnswerOfAnotherServoIsRefused) {
  Bench bench(GetParam(), 2);
  bench.devices.add_fault({.kind = FaultKind::stranger, .servo = 2});
  bench.bus.begin_cycle(bench.servos, false);
  std::vector<ServoReading> readings(2);
  EXPECT_EQ(bench.bus.read_all(readings), 1U);
  EXPECT_EQ(bench.bus.counts().strangers, 1U);
  EXPECT_FALSE(bench.bus.read(2, *bench.model.find(ServoRole::torque_enable)));
}

TEST_P(EveryBus, ServosThatShareIdAreFound) {
  Bench bench(GetParam(), 3);
  bench.devices.servos()[2].set(ServoRole::id, 2);
  bench.machine.states[2].position = 0.45;
  bench.machine.run(bench.link, 0.01);
  const auto found = bench.bus.ping_all();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].answers, 1U);
  EXPECT_EQ(found[1].id, 2);
  EXPECT_EQ(found[1].answers, 2U);
}

TEST_P(EveryBus, ServoAtAnotherRateIsSilent) {
  Bench bench(GetParam(), 1);
  bench.devices.servos()[0].set(ServoRole::baud_rate, 2);
  EXPECT_FALSE(bench.bus.ping(1));
  bench.link.set_rate(bench.devices.servos()[0].rate());
  bench.bus.set_rate(bench.devices.servos()[0].rate());
  EXPECT_TRUE(bench.bus.ping(1));
}

TEST_P(EveryBus, UnpluggedLinkIsLostUntilItIsOpenedAgain) {
  Bench bench(GetParam(), 1);
  const Time begin = bench.machine.now, end = begin + from_seconds(0.5);
  bench.devices.add_fault({.kind = FaultKind::unplug, .begin = begin, .end = end});
  bench.machine.run(bench.link, 0.1);
  EXPECT_FALSE(bench.bus.ping(1));
  EXPECT_TRUE(bench.link.is_lost());
  std::string why;
  EXPECT_FALSE(bench.link.reopen(why));
  bench.machine.run(bench.link, 0.5);
  EXPECT_TRUE(bench.link.reopen(why));
  EXPECT_TRUE(bench.bus.ping(1));
}

INSTANTIATE_TEST_SUITE_P(Protocols, EveryBus, testing::Values("STS3215", "XL430-W250", "XM430-W350"),
                         [](const auto& one) {
                           std::string name = one.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(FeetechBus, EchoOfAdapterIsSkipped) {
  Bench bench("STS3215", 2, {{.kind = FaultKind::echo}});
  bench.bus.notice_echo();
  ASSERT_TRUE(bench.bus.has_echo());
  EXPECT_TRUE(bench.bus.ping(1));
  bench.bus.begin_cycle(bench.servos, false);
  std::vector<ServoReading> readings(2);
  EXPECT_EQ(bench.bus.read_all(readings), 2U);
}

// The number of bytes of a cycle, at ten bits each: the rates of docs/hardware_buses.md.
TEST(FeetechBus, CycleOfSixServosTakesItsBytesTime) {
  Bench bench("STS3215", 6);
  bench.bus.begin_cycle(bench.servos, false);
  std::vector<ServoReading> readings(6);
  const std::vector<ServoGoal> goals(6);
  const Time begin = bench.link.now();
  ASSERT_EQ(bench.bus.read_all(readings), 6U);
  ASSERT_TRUE(bench.bus.write_goals(goals));
  ASSERT_TRUE(bench.bus.ping(1));
  const double seconds = to_seconds(bench.link.now() - begin);
  // 14 + 6 * 12 bytes read, 8 + 6 * 8 written; and the ping of 6, its answer of 6, and the model's number,
  // 8 and 8.
  EXPECT_NEAR(seconds, (86 + 56 + 28) * 10e-6, 30e-6);
}

TEST(FeetechBus, TorqueOf128MakesPresentPositionMiddle) {
  Bench bench("STS3215", 1);
  bench.machine.states[0].position = 0.8;
  bench.machine.run(bench.link, 0.01);
  EXPECT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::torque_enable), 128));
  bench.machine.run(bench.link, 0.01);
  EXPECT_EQ(bench.bus.read(1, *bench.model.find(ServoRole::present_position)), 2048);
  EXPECT_EQ(bench.bus.read(1, *bench.model.find(ServoRole::homing_offset)), 522);
}

TEST(DynamixelBus, FiredWatchdogRefusesGoalsUntilItIsCleared) {
  Bench bench("XL430-W250", 1);
  bench.bus.begin_cycle(bench.servos, false);
  ASSERT_TRUE(bench.set_torque(1, true));
  ASSERT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::watchdog), 10));
  ASSERT_TRUE(bench.bus.write_goals(std::vector<ServoGoal>{{1.5, 0}}));
  bench.machine.run(bench.link, 0.15);
  const double moving = bench.machine.states[0].position;
  bench.machine.run(bench.link, 1.0);
  EXPECT_GT(moving, 0.1);
  EXPECT_LT(bench.machine.states[0].position, 1.4) << "it stops after 0.2 s of silence";
  EXPECT_EQ(bench.bus.read(1, *bench.model.find(ServoRole::watchdog)), -1);
  EXPECT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::goal_position), 2048));
  EXPECT_EQ(bench.bus.last_error() & 0x7F, static_cast<unsigned>(AccessError::range));
  ASSERT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::watchdog), 0));
  EXPECT_TRUE(bench.bus.write(1, *bench.model.find(ServoRole::goal_position), 2048));
  EXPECT_EQ(bench.bus.last_error(), 0U);
}

TEST(DynamixelBus, OverloadLatchesUntilReboot) {
  Bench bench("XL430-W250", 1);
  ASSERT_TRUE(bench.set_torque(1, true));
  bench.machine.loads[0] = 10;
  bench.machine.run(bench.link, 3.5);
  EXPECT_EQ(bench.bus.read(1, *bench.model.find(ServoRole::torque_enable)), 0);
  EXPECT_EQ(bench.model.faults(*bench.bus.read(1, *bench.model.find(ServoRole::errors))), kOverloadFault);
  bench.machine.loads[0] = 0;
  EXPECT_TRUE(bench.set_torque(1, true));
  EXPECT_NE(bench.bus.last_error() & 0x7F, 0U);
  ASSERT_TRUE(bench.bus.reboot(1));
  bench.machine.run(bench.link, 0.1);
  EXPECT_TRUE(bench.set_torque(1, true));
  EXPECT_EQ(bench.bus.last_error(), 0U);
}

// 31 goals of Feetech's servos fit into one frame.
TEST_P(EveryBus, GoalsOfManyServosTakeSeveralFrames) {
  for (const std::size_t count : {31U, 32U, 33U, 100U, 252U}) {
    Bench bench(GetParam(), count);
    std::vector<ServoReading> readings(count);
    std::vector<ServoGoal> goals(count);
    for (const bool fast : {false, true}) {
      bench.bus.begin_cycle(bench.servos, fast);
      EXPECT_EQ(bench.bus.read_all(readings), count) << count << (fast ? " servos, fast" : " servos");
    }
    for (std::size_t i = 0; i < count; ++i) goals[i].position = 0.001 * static_cast<double>(i + 1);
    ASSERT_TRUE(bench.bus.write_goals(goals));
    for (std::size_t i = 0; i < count; ++i)
      EXPECT_EQ(bench.devices.servos()[i].value(ServoRole::goal_position),
                std::llround(bench.model.ticks(goals[i].position)))
          << "id " << i + 1 << " of " << count;
  }
}

// An answer of more bytes than needed shows that it is not a late one: every register can be read so.
TEST_P(EveryBus, LostAnswersChangeNoValue) {
  Bench bench(GetParam(), 3);
  bench.bus.begin_cycle(bench.servos, true);
  bench.devices.servos()[1].set(ServoRole::present_temperature, 40);
  std::vector<ServoReading> readings(3);
  const ServoRegister& number = *bench.model.find("Model_Number");
  const Time begin = bench.link.now();
  for (int losses = 1; losses <= 20; ++losses) {
    bench.devices.set_faults({{.kind = FaultKind::drop, .begin = begin}});
    for (int i = 0; i < losses; ++i) EXPECT_EQ(bench.bus.read_all(readings), 0U);
    bench.link.wait_until(bench.link.now() + from_seconds(1));
    bench.devices.set_faults({});
    EXPECT_EQ(bench.bus.read(1, number), bench.model.number);
    EXPECT_EQ(bench.bus.read_all(readings), 3U) << "after " << losses << " losses";
    EXPECT_NEAR(readings[1].position, 0, 0.002);
    EXPECT_TRUE(bench.set_torque(1, true));
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(bench.bus.read_health(readings));
    EXPECT_EQ(readings[1].temperature, 40);
  }
}

TEST_P(EveryBus, NoiseThatNoLineCanCarryIsLost) {
  for (const int rate : {kRate, 50}) {
    Bench bench(GetParam(), 1);
    const Time begin = bench.link.now();
    const std::vector<std::uint8_t> noise(512, 0xFF);
    for (int i = 0; i < 12'000; ++i) bench.devices.receive(noise, begin, rate);  // 6 MB, by a pipe
    bench.machine.run(bench.link, 0.3);
    EXPECT_TRUE(bench.bus.ping(1)) << "after noise at " << rate << " bit/s";
  }
}

// A link has bytes of such a partner after each deadline, too.
TEST_P(EveryBus, RequestEndsWherePartnerSendsWithoutEnd) {
  for (const bool frames : {false, true}) {
    SCOPED_TRACE(frames ? "answers of another servo" : "noise");
    Bench bench(GetParam(), 1);
    std::vector<std::uint8_t> bytes{'n', 'o', 'i', 's', 'e'};
    if (frames) bytes = answer_of_stranger(bench.model.protocol);
    test::EndlessLink link(bench.devices, "endless", kRate);
    link.follow(bench.machine.now);
    link.begin(bytes);
    ServoBus bus(link, bench.model.protocol, kRate);
    bus.set_patience(from_seconds(0.005));
    bus.begin_cycle(bench.servos, false);
    std::vector<ServoReading> readings(1);
    const ServoRegister& position = *bench.model.find(ServoRole::present_position);
    Time begin = link.now();
    EXPECT_FALSE(bus.read(1, position, 1));
    EXPECT_EQ(bus.read_all(readings), 0U);
    EXPECT_LT(to_seconds(link.now() - begin), 0.02);
    // So many answers are missing in the end that the bus waits for a quiet line.
    for (int i = 0; i < 20; ++i) {
      begin = link.now();
      EXPECT_FALSE(bus.read(1, position, 1));
      EXPECT_LT(to_seconds(link.now() - begin), 0.3) << "read " << i;
    }
  }
}

TEST_P(EveryBus, RegisteredWritesActTogether) {
  Bench bench(GetParam(), 2);
  const bool feetech = bench.model.protocol == ServoProtocol::feetech;
  const ServoRegister& goal = *bench.model.find(ServoRole::goal_position);
  for (std::uint8_t id = 1; id <= 2; ++id) {
    std::vector<std::uint8_t> parameters{static_cast<std::uint8_t>(goal.address)};
    if (!feetech) parameters.push_back(0);
    parameters.resize(parameters.size() + goal.size);
    encode_register(goal, 3000, std::span(parameters).last(goal.size));
    EXPECT_TRUE(bench.exchange(id, 4, parameters)) << "expected a status of servo " << int{id};
    EXPECT_NE(bench.devices.servos()[id - 1].value(ServoRole::goal_position), 3000);
    if (!feetech) {
      EXPECT_EQ(bench.devices.servos()[id - 1].value("Registered_Instruction"), 1);
    }
  }
  EXPECT_FALSE(bench.exchange(0xFE, 5, {})) << "an action of all has no answer";
  for (const RegisterServo& servo : bench.devices.servos())
    EXPECT_EQ(servo.value(ServoRole::goal_position), 3000);
}

TEST(BusEmulator, BulkReadIsAnsweredByEachServoInTurn) {
  Bench bench("XL430-W250", 2);
  const std::vector<std::uint8_t> parameters{2, 7, 0, 1, 0, 1, 0, 0, 2, 0};  // its id; the number of a model
  const std::vector<std::uint8_t> answer = bench.answer_to(0xFE, 0x92, parameters);
  DynamixelReader reader;
  ASSERT_EQ(reader.push(answer), answer.size());
  auto frame = reader.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->id, 2);
  EXPECT_THAT(frame->parameters, ElementsAre(0, 2));
  frame = reader.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->id, 1);
  EXPECT_THAT(frame->parameters, ElementsAre(0, 1060 & 0xFF, 1060 >> 8));
}

TEST(BusEmulator, FastSyncReadThatNoServoHasRoomForIsSilent) {
  Bench bench("XL430-W250", 100);
  std::vector<std::uint8_t> parameters{100, 0, 20, 0};
  for (std::uint8_t id = 1; id <= 100; ++id) parameters.push_back(id);
  EXPECT_TRUE(bench.answer_to(0xFE, 0x8A, parameters).empty());
}

// The state that the board reports within 0.2 s of a question.
std::optional<ServoLineState> ask_state(EmulatedLink& link) {
  FrameBytes question;
  question.add('\n');  // ends the line that noise has begun
  add_servo_line("Q", question);
  link.discard();
  EXPECT_TRUE(link.write(question.bytes()));
  ServoLineReader reader;
  std::array<std::uint8_t, 200> bytes{};
  const Time deadline = link.now() + from_seconds(0.2);
  while (const std::size_t count = link.read(bytes, deadline)) {
    reader.push(std::span(bytes).first(count));
    while (const auto body = reader.next()) {
      const ServoLineReply reply = parse_servo_reply(*body);
      if (const auto* const state = std::get_if<ServoLineState>(&reply)) return *state;
    }
  }
  return {};
}

TEST(BoardEmulator, NoiseThatNoLineCanCarryIsLost) {
  FrameBytes questions;
  while (questions.room() > 10) add_servo_line("Q", questions);
  for (const int rate : {115200, 50}) {
    BoardEmulator board(std::vector<HobbyServo>{{.channel = 0}});
    test::TestMachine machine(board, 1);
    EmulatedLink link(board, "emulated", 115200);
    machine.run(link, 0.1);
    const auto before = ask_state(link);
    ASSERT_TRUE(before);
    machine.run(link, 0.1);
    for (int i = 0; i < 1000; ++i) board.receive(questions.bytes(), link.now(), rate);  // 2 MB, by a pipe
    machine.run(link, 1);
    const auto first = ask_state(link);
    ASSERT_TRUE(first) << "after noise at " << rate << " bit/s";
    EXPECT_GT(first->milliseconds, before->milliseconds + 1000);
    machine.run(link, 1);
    const auto second = ask_state(link);
    ASSERT_TRUE(second);
    EXPECT_GT(second->milliseconds, first->milliseconds + 900) << "expected the board's clock to go on";
  }
}

TEST(BusEmulator, SameSeedGivesSameBytes) {
  const auto bytes_of = [](std::uint64_t seed) {
    const ServoModel& model = *find_servo_model("STS3215");
    BusEmulator devices(model.protocol, Bench::servos_of(model, 2),
                        {{.kind = FaultKind::corrupt, .share = 0.5}, {.kind = FaultKind::drop, .share = 0.3}},
                        seed);
    EmulatedLink link(devices, "emulated", kRate);
    ServoBus bus(link, model.protocol, kRate);
    std::string out;
    for (int i = 0; i < 50; ++i) out += bus.ping(1 + i % 2, 1) ? '1' : '0';
    return out;
  };
  EXPECT_EQ(bytes_of(1), bytes_of(1));
  EXPECT_NE(bytes_of(1), bytes_of(2));
}

}  // namespace
}  // namespace doppel
