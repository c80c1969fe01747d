#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "doppel/control/controllers/detail/broadcasters.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

using Covariance = std::array<double, 9>;  // row-major about x, y, z

// Throws InputError if there are not nine numbers.
Covariance declare_covariance(ControllerContext& context, const std::string& name) {
  Covariance out{};
  std::vector<double> written(out.size(), 0.0);
  const ParameterOptions nine{.check = [](const ParameterValue& value) {
    const auto count = std::get<std::vector<double>>(value).size();
    return count == 9 ? Status{} : Status::refused(fmt::format("it must be 9 numbers, not {}", count));
  }};
  declare_parameters(context, {{name, &written, "row-major about x, y, z", read_only(nine)}});
  std::ranges::copy(written, out.begin());
  return out;
}

// The integers of a fix; an interface that is not a number has the largest, as in the semantic component.
template <class T>
T integer_of(double value) {
  return value >= static_cast<double>(std::numeric_limits<T>::min()) &&
                 value <= static_cast<double>(std::numeric_limits<T>::max())
             ? static_cast<T>(value)
             : std::numeric_limits<T>::max();
}

class ImuBroadcaster : public MessageBroadcaster<sensor_msgs::msg::Imu> {
 public:
  void on_init(ControllerContext& context) override {
    std::string sensor;
    declare_parameters(
        context, {sensor_parameter(sensor, "imu"), frame_parameter(message_.header.frame_id, "imu_link")});
    message_.orientation_covariance = declare_covariance(context, "static_covariance_orientation");
    message_.angular_velocity_covariance = declare_covariance(context, "static_covariance_angular_velocity");
    message_.linear_acceleration_covariance =
        declare_covariance(context, "static_covariance_linear_acceleration");
    read(sensor, {"orientation.x", "orientation.y", "orientation.z", "orientation.w", "angular_velocity.x",
                  "angular_velocity.y", "angular_velocity.z", "linear_acceleration.x",
                  "linear_acceleration.y", "linear_acceleration.z"});
    advertise(context, "~/imu");
  }

 private:
  void fill() override {
    message_.orientation = {value(0), value(1), value(2), value(3)};
    message_.angular_velocity = {value(4), value(5), value(6)};
    message_.linear_acceleration = {value(7), value(8), value(9)};
  }
};

class RangeBroadcaster : public MessageBroadcaster<sensor_msgs::msg::Range> {
 public:
  void on_init(ControllerContext& context) override {
    std::string sensor;
    std::int64_t radiation = 0;
    double field_of_view = 0.52, least = 0.52, most = 4, variance = 0;
    declare_parameters(
        context, {sensor_parameter(sensor, "sonar"),
                  frame_parameter(message_.header.frame_id, "sonar_link"),
                  {"radiation_type", &radiation, "0: ultrasound, 1: infrared", read_only(value_range(0, 1))},
                  {"field_of_view", &field_of_view, "rad", read_only()},
                  {"min_range", &least, "m", read_only()},
                  {"max_range", &most, "m", read_only()},
                  {"variance", &variance, "m^2", read_only()}});
    message_.radiation_type = static_cast<std::uint8_t>(radiation);
    message_.field_of_view = static_cast<float>(field_of_view);
    message_.min_range = static_cast<float>(least);
    message_.max_range = static_cast<float>(most);
    message_.variance = static_cast<float>(variance);
    read(sensor, {"range"});
    advertise(context, "~/range");
  }

 private:
  void fill() override { message_.range = static_cast<float>(value(0)); }
};

class SatelliteBroadcaster : public MessageBroadcaster<sensor_msgs::msg::NavSatFix> {
 public:
  void on_init(ControllerContext& context) override {
    using sensor_msgs::msg::NavSatFix;
    std::string sensor;
    declare_parameters(context, {sensor_parameter(sensor, "gps"),
                                 frame_parameter(message_.header.frame_id, "gps_link"),
                                 {"read_covariance_from_interface", &reads_covariance_,
                                  "the covariance is read from state interfaces", read_only()}});
    const Covariance covariance = declare_covariance(context, "static_position_covariance");
    message_.position_covariance_type =
        reads_covariance_ ? NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN : NavSatFix::COVARIANCE_TYPE_KNOWN;
    if (!reads_covariance_) message_.position_covariance = covariance;
    read(sensor, {"status", "service", "latitude", "longitude", "altitude"});
    if (reads_covariance_)
      read(sensor, {"latitude_covariance", "longitude_covariance", "altitude_covariance"});
    advertise(context, "~/gps/fix");
  }

 private:
  void fill() override {
    message_.status.status = integer_of<std::int8_t>(value(0));
    message_.status.service = integer_of<std::uint16_t>(value(1));
    message_.latitude = value(2);
    message_.longitude = value(3);
    message_.altitude = value(4);
    for (std::size_t i = 0; reads_covariance_ && i < 3; ++i)
      message_.position_covariance[4 * i] = value(5 + i);
  }

  bool reads_covariance_ = false;
};

class MagnetometerBroadcaster : public MessageBroadcaster<sensor_msgs::msg::MagneticField> {
 public:
  void on_init(ControllerContext& context) override {
    std::string sensor;
    declare_parameters(context, {sensor_parameter(sensor, "magnetometer"),
                                 frame_parameter(message_.header.frame_id, "imu_link")});
    message_.magnetic_field_covariance = declare_covariance(context, "static_covariance");
    read(sensor, {"magnetic_field.x", "magnetic_field.y", "magnetic_field.z"});
    advertise(context, "~/magnetic_field");
  }

 private:
  void fill() override { message_.magnetic_field = {value(0), value(1), value(2)}; }
};

}  // namespace

ControllerParameter required_text(const char* name, std::string& text, const char* description,
                                  const char* example) {
  return {name, &text, description, read_only(), required_value(example, fmt::format(" ({})", description))};
}

ControllerParameter sensor_parameter(std::string& sensor, const char* example) {
  return required_text("sensor_name", sensor, "prefix of its state interfaces", example);
}

ControllerParameter frame_parameter(std::string& frame, const char* example) {
  return required_text("frame_id", frame, "frame of the values", example);
}

std::unique_ptr<Controller> make_imu_broadcaster() {
  return std::make_unique<ImuBroadcaster>();
}

std::unique_ptr<Controller> make_range_broadcaster() {
  return std::make_unique<RangeBroadcaster>();
}

std::unique_ptr<Controller> make_satellite_broadcaster() {
  return std::make_unique<SatelliteBroadcaster>();
}

std::unique_ptr<Controller> make_magnetometer_broadcaster() {
  return std::make_unique<MagnetometerBroadcaster>();
}

}  // namespace doppel
