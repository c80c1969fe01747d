// Keys of teleop_twist_keyboard: motions, speeds, and release by the end of a terminal's repetition.
#include "doppel/ros/teleop/teleop_keys.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

class TeleopKeysTest : public ::testing::Test {
 protected:
  [[nodiscard]] KeyTime at(double seconds) const {
    return start_ + std::chrono::duration_cast<KeyTime::duration>(std::chrono::duration<double>(seconds));
  }
  const KeyTime start_ = std::chrono::steady_clock::now();
  TeleopKeys keys_{KeySettings()};
};

TEST_F(TeleopKeysTest, MotionsAreThoseOfTeleopTwistKeyboard) {
  struct Case {
    char key;
    double x, y, z, turn;
  };
  for (const Case& c : {Case{'i', 0.5, 0, 0, 0}, Case{'o', 0.5, 0, 0, -1}, Case{'m', -0.5, 0, 0, -1},
                        Case{'.', -0.5, 0, 0, 1}, Case{'J', 0, 0.5, 0, 0}, Case{'>', -0.5, -0.5, 0, 0},
                        Case{'t', 0, 0, 0.5, 0}, Case{'k', 0, 0, 0, 0}}) {
    EXPECT_EQ(keys_.press(c.key, start_), KeyEffect::motion) << c.key;
    const auto twist = keys_.twist(start_);
    EXPECT_EQ(twist.linear.x, c.x) << c.key;
    EXPECT_EQ(twist.linear.y, c.y) << c.key;
    EXPECT_EQ(twist.linear.z, c.z) << c.key;
    EXPECT_EQ(twist.angular.z, c.turn) << c.key;
  }
}

TEST_F(TeleopKeysTest, EndOfRepetitionIsRelease) {
  keys_.press('i', at(0));
  EXPECT_TRUE(keys_.is_down(at(0.69))) << "expected the time until a terminal repeats";
  keys_.press('i', at(0.5));
  EXPECT_TRUE(keys_.is_down(at(1.1))) << "expected a second single press";
  keys_.press('i', at(0.53));
  EXPECT_FALSE(keys_.is_down(at(0.74))) << "expected the end of the repetition";
  EXPECT_EQ(keys_.twist(at(0.74)).linear.x, 0);
}

TEST_F(TeleopKeysTest, SpeedsAreLimited) {
  TeleopKeys keys({.speed = 0.5, .turn = 1.0, .speed_limit = 0.52, .turn_limit = 2.0});
  EXPECT_EQ(keys.press('q', start_), KeyEffect::speed);
  EXPECT_EQ(keys.speed(), 0.52);
  EXPECT_DOUBLE_EQ(keys.turn(), 1.1);
  keys.set_speed(7);
  EXPECT_EQ(keys.speed(), 0.52);
}

TEST_F(TeleopKeysTest, DigitsMoveJoints) {
  EXPECT_EQ(keys_.press('-', start_), KeyEffect::reverse);
  EXPECT_EQ(keys_.press('3', start_), KeyEffect::joint);
  EXPECT_EQ(keys_.joint(start_)->joint, 2);
  EXPECT_EQ(keys_.joint(start_)->direction, -1);
  EXPECT_EQ(keys_.twist(start_).linear.x, 0);
}

}  // namespace
}  // namespace doppel
