#include "doppel/control/controllers/detail/sensor_broadcasters.h"

#include <limits>

#include "doppel/control/controllers/detail/broadcaster_parameters.h"

namespace doppel {
namespace {

constexpr const char* kSensorName = "prefix of its state interfaces";
constexpr const char* kFrame = "frame of the values";

std::int64_t declare_radiation(ControllerContext& context) {
  ParameterOptions options{"0: ultrasound, 1: infrared", true, {}};
  options.range = ParameterRange{0, 1};
  return declare<std::int64_t>(context.node->parameters(), context.overrides, "radiation_type", 0, options);
}

// The integers of a fix; an interface that is not a number has the largest, as in the semantic component.
template <class T>
T integer_of(double value) {
  return value >= static_cast<double>(std::numeric_limits<T>::min()) &&
                 value <= static_cast<double>(std::numeric_limits<T>::max())
             ? static_cast<T>(value)
             : std::numeric_limits<T>::max();
}

}  // namespace

void SensorBroadcaster::read(const std::string& prefix, const std::vector<std::string>& names) {
  for (const std::string& name : names) interfaces_.push_back(prefix + "/" + name);
}

void ImuBroadcaster::on_init(ControllerContext& context) {
  const std::string sensor = declare_required_text(context, "sensor_name", kSensorName, "imu");
  message_.header.frame_id = declare_required_text(context, "frame_id", kFrame, "imu_link");
  message_.orientation_covariance = declare_covariance(context, "static_covariance_orientation");
  message_.angular_velocity_covariance = declare_covariance(context, "static_covariance_angular_velocity");
  message_.linear_acceleration_covariance =
      declare_covariance(context, "static_covariance_linear_acceleration");
  read(sensor, {"orientation.x", "orientation.y", "orientation.z", "orientation.w", "angular_velocity.x",
                "angular_velocity.y", "angular_velocity.z", "linear_acceleration.x", "linear_acceleration.y",
                "linear_acceleration.z"});
  bus_ = &context.node->bus();
  topic_ = context.node->advertise<sensor_msgs::msg::Imu>("~/imu", Qos::system_default_publisher());
}

void ImuBroadcaster::publish_state(Time now) {
  if (!topic_.has_listeners()) return;
  message_.orientation = {value(0), value(1), value(2), value(3)};
  message_.angular_velocity = {value(4), value(5), value(6)};
  message_.linear_acceleration = {value(7), value(8), value(9)};
  message_.header.stamp = to_time_msg(bus_->stamp(now));
  topic_.publish(message_, now);
}

void RangeBroadcaster::on_init(ControllerContext& context) {
  const std::string sensor = declare_required_text(context, "sensor_name", kSensorName, "sonar");
  message_.header.frame_id = declare_required_text(context, "frame_id", kFrame, "sonar_link");
  const auto number = [&](const char* name, double initial, const char* description) {
    return static_cast<float>(declare<double>(context.node->parameters(), context.overrides, name, initial,
                                              {description, true, {}}));
  };
  message_.radiation_type = static_cast<std::uint8_t>(declare_radiation(context));
  message_.field_of_view = number("field_of_view", 0.52, "rad");
  message_.min_range = number("min_range", 0.52, "m");
  message_.max_range = number("max_range", 4.0, "m");
  message_.variance = number("variance", 0.0, "m^2");
  read(sensor, {"range"});
  bus_ = &context.node->bus();
  topic_ = context.node->advertise<sensor_msgs::msg::Range>("~/range", Qos::system_default_publisher());
}

void RangeBroadcaster::publish_state(Time now) {
  if (!topic_.has_listeners()) return;
  message_.range = static_cast<float>(value(0));
  message_.header.stamp = to_time_msg(bus_->stamp(now));
  topic_.publish(message_, now);
}

void SatelliteBroadcaster::on_init(ControllerContext& context) {
  using sensor_msgs::msg::NavSatFix;
  const std::string sensor = declare_required_text(context, "sensor_name", kSensorName, "gps");
  message_.header.frame_id = declare_required_text(context, "frame_id", kFrame, "gps_link");
  const std::array<double, 9> covariance = declare_covariance(context, "static_position_covariance");
  reads_covariance_ =
      declare<bool>(context.node->parameters(), context.overrides, "read_covariance_from_interface", false,
                    {"the covariance is read from state interfaces", true, {}});
  message_.position_covariance_type =
      reads_covariance_ ? NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN : NavSatFix::COVARIANCE_TYPE_KNOWN;
  if (!reads_covariance_) message_.position_covariance = covariance;
  read(sensor, {"status", "service", "latitude", "longitude", "altitude"});
  if (reads_covariance_) read(sensor, {"latitude_covariance", "longitude_covariance", "altitude_covariance"});
  bus_ = &context.node->bus();
  topic_ = context.node->advertise<NavSatFix>("~/gps/fix", Qos::system_default_publisher());
}

void SatelliteBroadcaster::publish_state(Time now) {
  if (!topic_.has_listeners()) return;
  message_.status.status = integer_of<std::int8_t>(value(0));
  message_.status.service = integer_of<std::uint16_t>(value(1));
  message_.latitude = value(2);
  message_.longitude = value(3);
  message_.altitude = value(4);
  for (std::size_t i = 0; reads_covariance_ && i < 3; ++i) message_.position_covariance[4 * i] = value(5 + i);
  message_.header.stamp = to_time_msg(bus_->stamp(now));
  topic_.publish(message_, now);
}

void MagnetometerBroadcaster::on_init(ControllerContext& context) {
  using sensor_msgs::msg::MagneticField;
  const std::string sensor = declare_required_text(context, "sensor_name", kSensorName, "magnetometer");
  message_.header.frame_id = declare_required_text(context, "frame_id", kFrame, "imu_link");
  message_.magnetic_field_covariance = declare_covariance(context, "static_covariance");
  read(sensor, {"magnetic_field.x", "magnetic_field.y", "magnetic_field.z"});
  bus_ = &context.node->bus();
  topic_ = context.node->advertise<MagneticField>("~/magnetic_field", Qos::system_default_publisher());
}

void MagnetometerBroadcaster::publish_state(Time now) {
  if (!topic_.has_listeners()) return;
  message_.magnetic_field = {value(0), value(1), value(2)};
  message_.header.stamp = to_time_msg(bus_->stamp(now));
  topic_.publish(message_, now);
}

}  // namespace doppel
