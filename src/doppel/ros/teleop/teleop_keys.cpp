#include "doppel/ros/teleop/teleop_keys.h"

#include <algorithm>
#include <array>

namespace doppel {
namespace {

// As in teleop_twist_keyboard: x ahead, y to the left, z up, and the turn to the left.
struct MotionKey {
  char key;
  double x, y, z, turn;
};
constexpr std::array<MotionKey, 18> kMotionKeys{{{'i', 1, 0, 0, 0},
                                                 {'o', 1, 0, 0, -1},
                                                 {'j', 0, 0, 0, 1},
                                                 {'l', 0, 0, 0, -1},
                                                 {'u', 1, 0, 0, 1},
                                                 {',', -1, 0, 0, 0},
                                                 {'.', -1, 0, 0, 1},
                                                 {'m', -1, 0, 0, -1},
                                                 {'O', 1, -1, 0, 0},
                                                 {'I', 1, 0, 0, 0},
                                                 {'J', 0, 1, 0, 0},
                                                 {'L', 0, -1, 0, 0},
                                                 {'U', 1, 1, 0, 0},
                                                 {'<', -1, 0, 0, 0},
                                                 {'>', -1, -1, 0, 0},
                                                 {'M', -1, 1, 0, 0},
                                                 {'t', 0, 0, 1, 0},
                                                 {'b', 0, 0, -1, 0}}};

struct SpeedKey {
  char key;
  double speed, turn;  // factors
};
constexpr std::array<SpeedKey, 6> kSpeedKeys{
    {{'q', 1.1, 1.1}, {'z', 0.9, 0.9}, {'w', 1.1, 1}, {'x', 0.9, 1}, {'e', 1, 1.1}, {'c', 1, 0.9}}};

constexpr char kEndOfText = 3, kEndOfTransmission = 4;  // Ctrl-C and Ctrl-D in a raw terminal

const MotionKey* motion_of(char key) {
  const auto found = std::ranges::find(kMotionKeys, key, &MotionKey::key);
  return found == kMotionKeys.end() ? nullptr : &*found;
}

bool is_joint_key(char key) {
  return key >= '1' && key <= '9';
}

std::chrono::steady_clock::duration for_seconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(seconds));
}

}  // namespace

void TeleopKeys::hold(char key, KeyTime now) {
  // Terminals repeat a key after 250 to 660 ms, then every 15 to 50 ms.
  const bool repeats = key == key_ && now - pressed_ < for_seconds(settings_.repeat_hold);
  until_ = now + for_seconds(repeats ? settings_.repeat_hold : settings_.first_hold);
  key_ = key;
  pressed_ = now;
}

KeyEffect TeleopKeys::press(char key, KeyTime now) {
  if (key == kEndOfText || key == kEndOfTransmission) return KeyEffect::quit;
  if (const auto speed = std::ranges::find(kSpeedKeys, key, &SpeedKey::key); speed != kSpeedKeys.end()) {
    set_speed(settings_.speed * speed->speed);
    set_turn(settings_.turn * speed->turn);
    return KeyEffect::speed;
  }
  if (key == '-') {
    direction_ = -direction_;
    return KeyEffect::reverse;
  }
  if (is_joint_key(key)) {
    hold(key, now);
    return KeyEffect::joint;
  }
  if (motion_of(key) != nullptr) {
    hold(key, now);
  } else {
    key_ = 0;  // k and every other key stop
  }
  return KeyEffect::motion;
}

geometry_msgs::msg::Twist TeleopKeys::twist(KeyTime now) const {
  const MotionKey* motion = is_down(now) ? motion_of(key_) : nullptr;
  if (motion == nullptr) return {};
  const double v = settings_.speed;
  return {{motion->x * v, motion->y * v, motion->z * v}, {0, 0, motion->turn * settings_.turn}};
}

std::optional<TeleopKeys::JointMotion> TeleopKeys::joint(KeyTime now) const {
  if (!is_down(now) || !is_joint_key(key_)) return std::nullopt;
  return JointMotion{key_ - '1', direction_};
}

std::string_view teleop_help() {
  return R"(  moving:            with shift, sideways:
    u   i   o          U   I   O
    j   k   l          J   K   L
    m   ,   .          M   <   >
  t, b: up and down; k or any other key: stop; the base stops when the key is released
  q, z: both speeds +10 %, -10 %; w, x: only the linear one; e, c: only the angular one
  1 to 9: move a joint of the arm; -: in the other direction
  Ctrl-C: end
)";
}

}  // namespace doppel
