#pragma once
// Broadcasters that publish the state interfaces of one sensor as one message, in each update: IMU, force-torque, range,
// satellite and magnetic sensors and poses. Parameters, defaults, topics and QoS as in ros2_controllers (its jazzy
// branch, 4.x).

#include <array>
#include <string>
#include <vector>

#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel {

// Reads the named state interfaces, in order, and commands nothing.
class SensorBroadcaster : public Controller {
 public:
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override { return {}; }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override {
    return {InterfaceConfiguration::Kind::individual, interfaces_};
  }
  void update(Time now, Duration /*period*/) override { publish_state(now); }

 protected:
  // "<prefix>/<name>" for each of the names.
  void read(const std::string& prefix, const std::vector<std::string>& names);
  [[nodiscard]] double value(std::size_t i) const { return state_handles[i].get(); }

  Bus* bus_ = nullptr;
  std::vector<std::string> interfaces_;
};

class ImuBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  void publish_state(Time now) override;

 private:
  sensor_msgs::msg::Imu message_;
  Publisher<sensor_msgs::msg::Imu> topic_;
};

// Of interfaces that are not named, the message has NaN. Offsets are added before the multiplication, as there.
class ForceTorqueBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  void publish_state(Time now) override;

 private:
  void choose_interfaces(ControllerContext& context);
  std::array<bool, 6> read_{};  // force x, y, z, torque x, y, z
  std::array<double, 6> offset_{}, multiplier_{1, 1, 1, 1, 1, 1};
  geometry_msgs::msg::WrenchStamped message_;
  Publisher<geometry_msgs::msg::WrenchStamped> topic_;
};

class RangeBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  void publish_state(Time now) override;

 private:
  sensor_msgs::msg::Range message_;
  Publisher<sensor_msgs::msg::Range> topic_;
};

class SatelliteBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  void publish_state(Time now) override;

 private:
  bool reads_covariance_ = false;
  sensor_msgs::msg::NavSatFix message_;
  Publisher<sensor_msgs::msg::NavSatFix> topic_;
};

class MagnetometerBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  void publish_state(Time now) override;

 private:
  sensor_msgs::msg::MagneticField message_;
  Publisher<sensor_msgs::msg::MagneticField> topic_;
};

// A pose that is not finite, or whose quaternion is not of unit length, is published and not broadcast as a transform.
class PoseBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  Status on_activate() override;
  void publish_state(Time now) override;
  void housekeeping(Time now) override;

 private:
  std::string name_;
  const Log* log_ = nullptr;
  bool broadcasts_ = true, invalid_ = false, reported_ = false;
  Duration tf_period_{};  // 0: at each update
  Time next_tf_ = Time::min();
  geometry_msgs::msg::PoseStamped message_;
  tf2_msgs::msg::TFMessage transform_;
  Publisher<geometry_msgs::msg::PoseStamped> topic_;
  Publisher<tf2_msgs::msg::TFMessage> tf_;
};

}  // namespace doppel
