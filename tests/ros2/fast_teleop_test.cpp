// The nodes of `doppel teleop` on the network: their parameters read and set by a client of Fast DDS while the verb
// drives Kate, and a Joy message of another node.

#include <fcntl.h>
#include <linux/joystick.h>
#include <nav_msgs.h>
#include <rcl_interfaces.h>
#include <sensor_msgs.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "fast_kate_test.h"

namespace doppel::ros2_testing {
namespace {

using namespace rcl_interfaces::srv::dds_;  // NOLINT
using nav_msgs::msg::dds_::Odometry_;
using rcl_interfaces::msg::dds_::Parameter_;
using rcl_interfaces::msg::dds_::ParameterValue_;
using sensor_msgs::msg::dds_::Joy_;

ParameterValue_ double_value(double value) {
  ParameterValue_ out;
  out.type_() = 3;
  out.double_value_() = value;
  return out;
}

class FastTeleop : public FastKateTest {
 protected:
  ~FastTeleop() override {
    if (device_ >= 0) close(device_);
  }

  // `doppel teleop` with its input from a pipe that this process writes.
  void start(const std::string& verb) {
    const std::string pipe = twin().folder() / "input", log = twin().folder() / "teleop";
    unlink(pipe.c_str());
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    verb_ = std::make_unique<Process>(
        std::vector<std::string>{"bash", "-c", "exec " + doppel_program() + " teleop " + verb + " < " + pipe},
        twin().variables(), log);
    device_ = open(pipe.c_str(), O_WRONLY);
    ASSERT_GE(device_, 0);
  }
  [[nodiscard]] std::string teleop_output() const {
    std::ifstream file(twin().folder() / "teleop");
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void press(char key) { ASSERT_EQ(write(device_, &key, 1), 1); }
  void event(int type, int number, int value) {
    js_event out{};
    out.type = static_cast<std::uint8_t>(type);
    out.number = static_cast<std::uint8_t>(number);
    out.value = static_cast<std::int16_t>(value);
    ASSERT_EQ(write(device_, &out, sizeof(out)), static_cast<ssize_t>(sizeof(out)));
  }
  int end() {
    close(std::exchange(device_, -1));
    return verb_->wait();
  }

  std::optional<ParameterValue_> parameter(const std::string& node, const std::string& name) {
    ServiceClient<GetParameters_Request_, GetParameters_Response_> client(peer, node + "/get_parameters");
    GetParameters_Request_ request;
    request.names_() = {name};
    const auto answer = client.call(request);
    if (!answer || answer->values_().size() != 1) return std::nullopt;
    return answer->values_()[0];
  }
  // The reason of a refusal; "": done.
  std::string set(const std::string& node, const std::string& name, const ParameterValue_& value) {
    ServiceClient<SetParameters_Request_, SetParameters_Response_> client(peer, node + "/set_parameters");
    SetParameters_Request_ request;
    Parameter_ parameter;
    parameter.name_() = name;
    parameter.value_() = value;
    request.parameters_() = {parameter};
    const auto answer = client.call(request);
    if (!answer || answer->results_().size() != 1) return "no response";
    const auto& result = answer->results_()[0];
    return result.successful_() ? "" : "refused: " + result.reason_();
  }
  // Whether the base gets this fast, while `again` is done for each message.
  bool reaches(
      double speed, const std::function<void()>& again = [] {}) {
    return odometry_
        .next([&](const Odometry_& odometry) {
          again();
          return std::abs(odometry.twist_().twist_().linear_().x_() - speed) < 0.02;
        })
        .has_value();
  }

 private:
  Subscription<Odometry_> odometry_ = peer.subscribe<Odometry_>("rt/base_controller/odom");
  std::unique_ptr<Process> verb_;
  int device_ = -1;
};

TEST_F(FastTeleop, KeyboardHasNodeAndItsParameters) {
  start("keyboard");
  const auto stamped = parameter("/teleop_twist_keyboard", "stamped");
  ASSERT_TRUE(stamped.has_value()) << teleop_output();
  EXPECT_TRUE(stamped->type_() == 1 && stamped->bool_value_())
      << "expected the type that the controller reads";
  EXPECT_TRUE(reaches(0.5, [&] { press('i'); })) << teleop_output();
  EXPECT_EQ(set("/teleop_twist_keyboard", "speed", double_value(0.2)), "");
  EXPECT_TRUE(reaches(0.2, [&] { press('i'); })) << "expected the speed that was set";
  press('q');
  EXPECT_TRUE(eventually([&] {
    const auto speed = parameter("/teleop_twist_keyboard", "speed");
    return speed && std::abs(speed->double_value_() - 0.22) < 1e-9;
  }));
  ParameterValue_ off;
  off.type_() = 1;
  EXPECT_NE(set("/teleop_twist_keyboard", "stamped", off).find("read-only"), std::string::npos);
  EXPECT_TRUE(reaches(0, [&] { press('k'); }));
  EXPECT_EQ(end(), 0) << teleop_output();
}

TEST_F(FastTeleop, JoystickHasBothNodesAndTheirParameters) {
  start("joy --device /dev/stdin --ros-args -p enable_button:=4 -p axis_linear.x:=1");
  auto joys = peer.subscribe<Joy_>("rt/joy");
  ASSERT_TRUE(parameter("/joy_node", "deadzone").has_value()) << teleop_output();
  event(JS_EVENT_AXIS, 1, -32767);
  event(JS_EVENT_BUTTON, 4, 1);
  EXPECT_TRUE(joys.next([](const Joy_& joy) {
                    return joy.header_().frame_id_() == "joy" && joy.axes_().size() == 2 &&
                           joy.axes_()[1] == 1.0F &&
                           joy.buttons_() == std::vector<std::int32_t>{0, 0, 0, 0, 1};
                  })
                  .has_value())
      << teleop_output();
  EXPECT_TRUE(reaches(0.5)) << teleop_output();
  EXPECT_EQ(set("/teleop_twist_joy_node", "scale_linear.x", double_value(0.2)), "");
  EXPECT_TRUE(reaches(0.2)) << "expected the scale that was set";
  EXPECT_EQ(set("/joy_node", "deadzone", double_value(0.5)), "");
  event(JS_EVENT_AXIS, 1, -24575);  // 0.75 of the range, the half of what is outside of the dead zone
  EXPECT_TRUE(reaches(0.1));
  EXPECT_NE(set("/teleop_twist_joy_node", "scale_linear.x", ParameterValue_()), "");
  event(JS_EVENT_BUTTON, 4, 0);
  EXPECT_TRUE(reaches(0)) << "expected rest without the dead-man button";
  EXPECT_EQ(end(), 0) << teleop_output();
}

TEST_F(FastTeleop, JoyOfAnotherNodeDrives) {
  start("joy --device /dev/stdin --ros-args -p enable_button:=0 -p axis_linear.x:=0 -p scale_linear.x:=0.3");
  auto joys = peer.advertise<Joy_>("rt/joy");
  ASSERT_TRUE(eventually([&] { return joys.matched() > 0; })) << teleop_output();
  Joy_ joy;
  joy.axes_() = {1.0F};
  joy.buttons_() = {1};
  EXPECT_TRUE(reaches(0.3, [&] { joys.publish(joy); })) << teleop_output();
  joy.buttons_() = {0};
  EXPECT_TRUE(reaches(0, [&] { joys.publish(joy); }));
  EXPECT_EQ(end(), 0) << teleop_output();
}

TEST_F(FastTeleop, RemoteVerbPublishesAsItsNode) {
  start("keyboard --remote --ros-args -r cmd_vel:=/base_controller/cmd_vel -p stamped:=false");
  EXPECT_TRUE(reaches(0.5, [&] { press('i'); })) << teleop_output();
  EXPECT_TRUE(eventually([&] {
    return twin().output().find("/teleop_twist_keyboard (process") != std::string::npos;
  })) << "expected the report about its Twist, with the node's name\n"
      << twin().output();
  EXPECT_EQ(end(), 0) << teleop_output();
  EXPECT_TRUE(reaches(0));
}

}  // namespace
}  // namespace doppel::ros2_testing
