// A board that is late with an answer, or whose answers are lost: no later line takes an answer for its own.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string_view>
#include <vector>

#include "doppel/devices/drivers/detail/servo_group.h"
#include "doppel/devices/emulation/board_emulator.h"
#include "doppel/devices/emulation/test/endless_link.h"
#include "doppel/devices/emulation/test/test_machine.h"
#include "doppel/devices/frames/servo_line.h"

namespace doppel {
namespace {

constexpr double kBoardTick = 0.003;  // rad: a pulse is reported in whole microseconds
constexpr Duration kBoardPeriod{20'000'000};

class LateBoard : public testing::Test {
 protected:
  LateBoard() : readings_(1) {
    setup_.component = "LateBoard";
    setup_.protocol = ServoProtocol::servo_line;
    setup_.port = "emulated";
    setup_.rate = 115200;
    setup_.confirm_pose = false;
    JointServo& joint = setup_.joints.emplace_back();
    joint.joint = "j";
    joint.velocity = 2;
    joint.lower = -1.5;
    joint.upper = 1.5;
    link_.set_world([this](Time when) {
      while (machine_.now < when) machine_.step();
    });
    link_.wait_until(Time{} + kBoardPeriod);
    group_ = make_line_group(setup_, link_);
    const Status connected = group_->connect();
    EXPECT_TRUE(connected) << connected.why();
    const Status started = group_->start(1);
    EXPECT_TRUE(started) << started.why();
  }

  // The next answers, for `seconds`.
  void disturb(FaultKind kind, double seconds, double amount = 0) {
    board_.add_fault(
        {.kind = kind, .begin = link_.now(), .end = link_.now() + from_seconds(seconds), .amount = amount});
  }
  void command(double position) {
    EXPECT_TRUE(group_->write(std::vector<ServoGoal>{{position, 0}}));
    answered_ = (board_.pulse(0) - 1500) / 2000 * M_PI;
  }
  void wait() { link_.wait_until(link_.now() + kBoardPeriod); }
  // From now on the board sends this line again and again.
  void send_without_end(std::string_view body) {
    FrameBytes line;
    add_servo_line(body, line);
    link_.begin(std::vector<std::uint8_t>(line.bytes().begin(), line.bytes().end()));
    endless_since_ = link_.now();
  }
  [[nodiscard]] double waited() const { return to_seconds(link_.now() - endless_since_); }

  ServoSetup setup_;
  BoardEmulator board_{std::vector<HobbyServo>{{.channel = 0, .velocity = 6}}};
  test::TestMachine machine_{board_, 1};
  test::EndlessLink link_{board_, "emulated", 115200};
  std::unique_ptr<ServoGroup> group_;
  std::vector<ServoReading> readings_;
  double answered_ = 0;  // rad: what the board has answered the last command with
  Time endless_since_{};
};

TEST_F(LateBoard, StateIsAnswerToOwnCommand) {
  int fresh = 0;
  for (int cycle = 0; cycle < 200; ++cycle) {
    if (cycle % 50 == 20) disturb(FaultKind::late, 0.01, 0.08);
    if (cycle % 50 == 40) disturb(FaultKind::drop, 0.01);
    command(std::sin(3 * to_seconds(link_.now() - Time{})));
    wait();
    if (group_->read(readings_) == 0) continue;
    ++fresh;
    EXPECT_NEAR(readings_[0].position, answered_, kBoardTick) << "cycle " << cycle;
  }
  EXPECT_GT(fresh, 150);
  EXPECT_GT(group_->counts().lost, 0U) << "expected that an answer was late";
}

TEST_F(LateBoard, NoLineIsConfirmedByEarlierAnswer) {
  disturb(FaultKind::late, 0.01, 0.08);
  EXPECT_FALSE(group_->relax());
  disturb(FaultKind::drop, 0.04);
  EXPECT_FALSE(group_->relax()) << "a line that the board has not confirmed";
  const Status confirmed = group_->relax();
  EXPECT_TRUE(confirmed) << confirmed.why();
}

// A link has bytes of such a partner after each deadline, too.
TEST_F(LateBoard, NoiseWithoutEndIsNoAnswer) {
  send_without_end("noise");
  EXPECT_FALSE(group_->relax());
  EXPECT_EQ(group_->read(readings_), 0U);
  EXPECT_LT(waited(), 0.2);
}

TEST_F(LateBoard, AnswersWithoutEndAreNoState) {
  send_without_end("A W");
  EXPECT_EQ(group_->read(readings_), 0U);
  EXPECT_LT(waited(), 0.1);
}

TEST_F(LateBoard, StatesWithoutEndConfirmNoLine) {
  send_without_end("T 1 0 0 5000 1500");
  EXPECT_FALSE(group_->relax());
  EXPECT_LT(waited(), 0.1);
}

TEST_F(LateBoard, SecondCommandOfCycleIsAnsweredByItsOwnState) {
  command(-0.8);
  for (int i = 0; i < 10; ++i) wait();
  const double first = answered_;
  command(-0.8);
  EXPECT_GT(std::abs(answered_ - first), 10 * kBoardTick) << "expected the servo to move";
  wait();
  ASSERT_EQ(group_->read(readings_), 1U);
  EXPECT_NEAR(readings_[0].position, answered_, kBoardTick);
}

}  // namespace
}  // namespace doppel
