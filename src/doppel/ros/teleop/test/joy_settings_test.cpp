// The parameters of joy_node and teleop_twist_joy_node: from YAML, changed while the nodes exist, and their velocity.
#include "doppel/ros/teleop/joy_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace doppel {
namespace {

using ::testing::HasSubstr;

class JoySettingsTest : public ::testing::Test {
 protected:
  ~JoySettingsTest() override { std::filesystem::remove(file_); }

  JoySettings read(const std::string& yaml) {
    std::ofstream(file_) << yaml;
    return read_joy_settings(file_, diagnostics_);
  }
  static sensor_msgs::msg::Joy joystick(std::vector<float> axes, std::vector<std::int32_t> buttons) {
    sensor_msgs::msg::Joy joy;
    joy.axes = std::move(axes);
    joy.buttons = std::move(buttons);
    return joy;
  }

  const std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("doppel_joy_" + std::to_string(::getpid()) + ".yaml");
  Diagnostics diagnostics_;
};

TEST_F(JoySettingsTest, FileOfBothNodesIsRead) {
  const JoySettings s = read(
      "joy_node:\n  ros__parameters: {device_id: 2, deadzone: 0.3, autorepeat_rate: 10.0, sticky_buttons: "
      "true}\n"
      "teleop_twist_joy_node:\n  ros__parameters:\n    axis_linear: {x: 1}\n    scale_angular: {yaw: 0.4}\n"
      "    enable_button: 8\n");
  EXPECT_EQ(s.device_id, 2);
  EXPECT_EQ(s.deadzone, 0.3);
  EXPECT_TRUE(s.sticky_buttons);
  EXPECT_EQ(s.axis_linear.at("x"), 1);
  EXPECT_EQ(s.scale_angular.at("yaw"), 0.4);
  EXPECT_EQ(s.enable_button, 8);
  EXPECT_EQ(s.enable_turbo_button, -1) << "expected the node's default";
  EXPECT_TRUE(diagnostics_.all().empty());
}

TEST_F(JoySettingsTest, UnknownNameIsReported) {
  read("teleop_twist_joy_node:\n  ros__parameters: {enable_buton: 3}\n");
  ASSERT_EQ(diagnostics_.all().size(), 1u);
  EXPECT_THAT(diagnostics_.all()[0].str(), HasSubstr("did you mean 'enable_button'"));
}

TEST_F(JoySettingsTest, WrittenFileReadsBack) {
  JoySettings s;
  s.device_id = 3;
  s.device_name = "Pad \"X\": #1 \\ 'a'";
  s.deadzone = 0.123456789012;
  s.autorepeat_rate = 0;
  s.sticky_buttons = true;
  s.coalesce_interval_ms = 7;
  s.require_enable_button = false;
  s.inverted_reverse = true;
  s.enable_button = 9;
  s.enable_turbo_button = 4;
  s.frame = "base";
  s.publish_stamped_twist = true;
  s.axis_linear = {{"x", 1}, {"y", 2}, {"z", 3}};
  s.axis_angular = {{"yaw", 7}, {"pitch", 8}, {"roll", 9}};
  s.scale_linear = {{"x", 1e-7}, {"y", 0.2}, {"z", 3}};
  s.scale_linear_turbo = {{"x", -1.5}, {"y", 0.3}, {"z", 1e20}};
  s.scale_angular = {{"yaw", 0.4}, {"pitch", 0.5}, {"roll", 0.6}};
  s.scale_angular_turbo = {{"yaw", -2}, {"pitch", 0.7}, {"roll", 0.8}};
  EXPECT_TRUE(read(to_yaml(s)) == s) << to_yaml(s);
  EXPECT_TRUE(read(to_yaml({})) == JoySettings()) << to_yaml({});
  EXPECT_TRUE(diagnostics_.all().empty());
  EXPECT_THAT(to_yaml(s), HasSubstr("autorepeat_rate: 0.0\n")) << "expected what ROS 2 reads as a double";
}

TEST_F(JoySettingsTest, OnlyFileOfBothNodesIsReplaceable) {
  read(to_yaml({}));
  EXPECT_NO_THROW(check_replaceable(file_));
  const auto refusal = [&](const std::string& yaml) -> std::string {
    std::ofstream(file_) << to_yaml({}) << yaml;
    try {
      check_replaceable(file_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("base:\n  ros__parameters: {wheel: 0.1}\n"), HasSubstr("the section 'base'"));
  EXPECT_THAT(refusal("/**:\n  ros__parameters: {use_sim_time: true}\n"), HasSubstr("the section '/**'"));
  EXPECT_THAT(refusal("left:\n  joy_node:\n    ros__parameters: {deadzone: 0.1}\n"),
              HasSubstr("the section 'left'"));
  EXPECT_THAT(refusal("    enable_buton: 3\n"), HasSubstr("it would be lost"));
}

TEST_F(JoySettingsTest, RepetitionFollowsRateWithinRangeOfClock) {
  using Time = std::chrono::steady_clock::time_point;
  const Time now = std::chrono::steady_clock::now();
  const auto next = [&](double rate) {
    JoySettings s;
    s.autorepeat_rate = rate;
    return next_repetition(s, now);
  };
  EXPECT_EQ(next(20), now + std::chrono::milliseconds(50));
  EXPECT_EQ(next(0), Time::max()) << "expected no repetition";
  EXPECT_EQ(next(1e-10), Time::max());
  EXPECT_GT(next(1e-8), now + std::chrono::hours(24 * 365));
}

TEST_F(JoySettingsTest, SettingsFollowParametersOfNodes) {
  Bus bus;
  JoySettings settings;
  ParameterOverrides none;
  Node joy(bus, "/joy_node"), twist(bus, "/teleop_twist_joy_node");
  declare_joy(joy, none, settings);
  declare_twist_joy(twist, none, settings, true);
  EXPECT_TRUE(twist.parameters().set("scale_linear.x", 0.2).ok());
  EXPECT_TRUE(twist.parameters().set("axis_angular.yaw", std::int64_t{3}).ok());
  EXPECT_TRUE(joy.parameters().set("deadzone", 0.25).ok());
  EXPECT_EQ(settings.scale_linear.at("x"), 0.2);
  EXPECT_EQ(settings.axis_angular.at("yaw"), 3);
  EXPECT_EQ(settings.deadzone, 0.25);
  EXPECT_FALSE(twist.parameters().set("axis_linear.x", 0.5).ok()) << "expected an integer";
  EXPECT_FALSE(joy.parameters().set("deadzone", 1.0).ok());
  EXPECT_FALSE(joy.parameters().set("device_id", std::int64_t{1}).ok()) << "expected a read-only parameter";
  EXPECT_FALSE(twist.parameters().set("publish_stamped_twist", false).ok())
      << "expected a read-only parameter";
  EXPECT_EQ(twist.parameters().find("publish_stamped_twist")->value, ParameterValue(true));
}

TEST_F(JoySettingsTest, DeadManButtonEnables) {
  JoySettings s;
  s.axis_linear["x"] = 1;
  s.axis_angular["yaw"] = 0;
  s.enable_button = 2;
  s.enable_turbo_button = 3;
  const auto velocity = [&](std::vector<std::int32_t> buttons) {
    return joy_twist(s, joystick({-0.5F, 1.0F}, std::move(buttons)));
  };
  EXPECT_EQ(velocity({0, 0, 0, 0}).linear.x, 0);
  EXPECT_EQ(velocity({}).linear.x, 0) << "expected rest without such a button";
  EXPECT_EQ(velocity({0, 0, 1, 0}).linear.x, 0.5);
  EXPECT_EQ(velocity({0, 0, 1, 0}).angular.z, -0.25);
  EXPECT_EQ(velocity({0, 0, 0, 1}).linear.x, 1.0) << "expected the scale of turbo";
  s.require_enable_button = false;
  EXPECT_EQ(velocity({}).linear.x, 0.5);
}

TEST_F(JoySettingsTest, InvertedReverseTurnsToOtherSide) {
  JoySettings s;
  s.require_enable_button = false;
  s.axis_linear["x"] = 0;
  s.axis_angular["yaw"] = 1;
  s.inverted_reverse = true;
  EXPECT_EQ(joy_twist(s, joystick({1, 1}, {})).angular.z, 0.5);
  EXPECT_EQ(joy_twist(s, joystick({-1, 1}, {})).angular.z, -0.5);
}

}  // namespace
}  // namespace doppel
