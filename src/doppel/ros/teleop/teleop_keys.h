#pragma once
// What the keys of `doppel teleop keyboard` do: those of teleop_twist_keyboard, and 1 to 9 for the joints of an arm.
// A terminal reports no release of a key: it is taken as released when its repetition ends.

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel {

using KeyTime = std::chrono::steady_clock::time_point;

struct KeySettings {
  double speed = 0.5, turn = 1.0;  // m/s, rad/s
  double speed_limit = 1000.0, turn_limit = 1000.0;
  double first_hold = 0.7;   // s, until a terminal repeats a key that stays down
  double repeat_hold = 0.2;  // s, between repetitions at most
};

enum class KeyEffect {
  none,
  motion,   // of the base, or its end
  speed,    // speed or turn were changed
  joint,    // a joint of an arm moves
  reverse,  // joints move in the other direction from now on
  quit
};

class DOPPEL_API TeleopKeys {
 public:
  explicit TeleopKeys(const KeySettings& settings) : settings_(settings) {}

  KeyEffect press(char key, KeyTime now);
  // The velocity of the base while a key is down; zero otherwise.
  [[nodiscard]] geometry_msgs::msg::Twist twist(KeyTime now) const;
  // The joint (0 to 8) whose key is down, and its direction, 1 or -1.
  struct JointMotion {
    int joint = 0;
    double direction = 1;
  };
  [[nodiscard]] std::optional<JointMotion> joint(KeyTime now) const;
  [[nodiscard]] bool is_down(KeyTime now) const { return key_ != 0 && now < until_; }

  // Of the next velocity; at most the limits.
  void set_speed(double speed) { settings_.speed = std::min(speed, settings_.speed_limit); }
  void set_turn(double turn) { settings_.turn = std::min(turn, settings_.turn_limit); }
  [[nodiscard]] double speed() const { return settings_.speed; }
  [[nodiscard]] double turn() const { return settings_.turn; }
  [[nodiscard]] double direction() const { return direction_; }

 private:
  void hold(char key, KeyTime now);

  KeySettings settings_;
  char key_ = 0;  // the last one that moves something; 0: none
  KeyTime pressed_{}, until_{};
  double direction_ = 1;  // of joints
};

// The help that is printed at the start.
DOPPEL_API std::string_view teleop_help();

}  // namespace doppel
