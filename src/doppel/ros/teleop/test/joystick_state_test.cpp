// Joystick events against joy_node's values: order of axes, signs, dead zone, buttons.
#include "doppel/ros/teleop/joystick_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/input-event-codes.h>
#include <linux/joystick.h>

#include <cstring>

namespace doppel {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatNear;

std::vector<std::byte> joystick_event(int type, int number, int value) {
  js_event event{};
  event.type = static_cast<std::uint8_t>(type);
  event.number = static_cast<std::uint8_t>(number);
  event.value = static_cast<std::int16_t>(value);
  std::vector<std::byte> bytes(sizeof(event));
  std::memcpy(bytes.data(), &event, sizeof(event));
  return bytes;
}
std::vector<std::byte> axis_event(int number, int value) {
  return joystick_event(JS_EVENT_AXIS, number, value);
}
std::vector<std::byte> button_event(int number, int value) {
  return joystick_event(JS_EVENT_BUTTON, number, value);
}

std::vector<std::size_t> places_of(const std::vector<std::uint8_t>& codes) {
  return sdl_axis_places(codes);
}

TEST(SdlAxisPlaces, GamepadOfKernelIsInSdlOrder) {
  // An Xbox pad: sticks, triggers, one hat.
  EXPECT_THAT(places_of({ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ, ABS_HAT0X, ABS_HAT0Y}),
              ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

TEST(SdlAxisPlaces, AxesAboveHatsComeBeforeThem) {
  EXPECT_THAT(places_of({ABS_X, ABS_Y, ABS_HAT0X, ABS_HAT0Y, ABS_PRESSURE, ABS_MISC}),
              ElementsAre(0, 1, 4, 5, 2, 3));
}

TEST(SdlAxisPlaces, RemappedAxesHaveSdlOrder) {
  // jscal changes the kernel's order, which SDL does not use.
  EXPECT_THAT(places_of({ABS_RY, ABS_X, ABS_Y}), ElementsAre(2, 0, 1));
}

TEST(SdlAxisPlaces, HatsAreCountedInPairs) {
  // The second hat has only one axis, and SDL has no gap for the missing first one.
  EXPECT_THAT(places_of({ABS_X, ABS_HAT1Y, ABS_HAT3X, ABS_HAT3Y}), ElementsAre(0, 2, 3, 4));
}

TEST(JoystickState, AxesAreInvertedAndScaledOutsideOfDeadZone) {
  JoystickState state({}, 3, 2);
  state.set_deadzone(0.1);
  EXPECT_TRUE(state.take(axis_event(0, -32767)).axes);
  EXPECT_TRUE(state.take(axis_event(1, 32767)).axes);
  EXPECT_FALSE(state.take(axis_event(2, 3000)).axes) << "expected no change inside of the dead zone";
  EXPECT_THAT(state.values().axes, ElementsAre(1.0F, -1.0F, 0.0F));
  state.take(axis_event(0, -32767 / 2));
  EXPECT_THAT(state.values().axes[0], FloatNear(0.4F / 0.9F, 1e-4F));
  state.take(axis_event(0, -32768));
  EXPECT_EQ(state.values().axes[0], 1.0F);
}

TEST(JoystickState, DeadZoneMayChange) {
  JoystickState state;
  state.take(axis_event(0, -8192));
  state.set_deadzone(0.5);
  EXPECT_EQ(state.values().axes[0], 0);
  state.set_deadzone(0);
  EXPECT_THAT(state.values().axes[0], FloatNear(0.25F, 1e-4F));
}

TEST(JoystickState, HatIsLastAndLeftAndUpArePositive) {
  JoystickState state(places_of({ABS_X, ABS_HAT0X, ABS_HAT0Y, ABS_MISC}));
  EXPECT_EQ(state.values().axes.size(), 4u);
  state.take(axis_event(1, -32767));  // left
  state.take(axis_event(2, 32767));   // down
  state.take(axis_event(3, -32767));
  EXPECT_THAT(state.values().axes, ElementsAre(0, 1, 1, -1));
}

TEST(JoystickState, ButtonsFollowPresses) {
  JoystickState state({}, 0, 3);
  EXPECT_TRUE(state.take(button_event(2, 1)).buttons);
  EXPECT_THAT(state.values().buttons, ElementsAre(0, 0, 1));
  EXPECT_TRUE(state.take(button_event(2, 0)).buttons);
  EXPECT_FALSE(state.take(button_event(2, 0)).any());
  EXPECT_THAT(state.values().buttons, ElementsAre(0, 0, 0));
}

TEST(JoystickState, StickyButtonChangesWithEachPress) {
  JoystickState state;
  state.set_sticky_buttons(true);
  state.take(joystick_event(JS_EVENT_BUTTON | JS_EVENT_INIT, 0, 0));
  EXPECT_THAT(state.values().buttons, ElementsAre(0));
  state.take(button_event(0, 1));
  EXPECT_FALSE(state.take(button_event(0, 0)).any());
  EXPECT_THAT(state.values().buttons, ElementsAre(1));
  state.take(button_event(0, 1));
  EXPECT_THAT(state.values().buttons, ElementsAre(0));
}

TEST(JoystickState, DividedEventsAreWhole) {
  JoystickState state;
  std::vector<std::byte> bytes = axis_event(1, 32767);
  const std::vector<std::byte> second = button_event(0, 1);
  bytes.insert(bytes.end(), second.begin(), second.end());
  const std::span<const std::byte> all(bytes);
  EXPECT_FALSE(state.take(all.first(5)).any());
  EXPECT_TRUE(state.take(all.subspan(5, 6)).axes);
  EXPECT_TRUE(state.take(all.subspan(11)).buttons);
  EXPECT_THAT(state.values().axes, ElementsAre(0, -1));
}

}  // namespace
}  // namespace doppel
