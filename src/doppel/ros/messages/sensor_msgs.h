#pragma once
// ROS 2's sensor_msgs: the state of joints (rad or m, rad/s or m/s, N m or N), images, and measurements of
// other sensors, in SI units unless noted. Covariances are row by row; a first element of -1: not measured.

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::sensor_msgs::msg {

struct JointState {
  std_msgs::msg::Header header;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
  DOPPEL_MESSAGE("sensor_msgs/msg/JointState", header, name, position, velocity, effort)
};

struct Image {
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;  // pixels
  std::string encoding;                 // "rgb8", "32FC1", ...
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;          // bytes of a row
  std::vector<std::uint8_t> data;  // [step * height]
  DOPPEL_MESSAGE("sensor_msgs/msg/Image", header, height, width, encoding, is_bigendian, step, data)
};

struct CompressedImage {
  std_msgs::msg::Header header;
  std::string format;  // "jpeg", "png"
  std::vector<std::uint8_t> data;
  DOPPEL_MESSAGE("sensor_msgs/msg/CompressedImage", header, format, data)
};

struct RegionOfInterest {
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;  // pixels
  bool do_rectify = false;
  DOPPEL_MESSAGE("sensor_msgs/msg/RegionOfInterest", x_offset, y_offset, height, width, do_rectify)
};

struct CameraInfo {
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;  // pixels
  std::string distortion_model;         // "plumb_bob"
  std::vector<double> d;                // distortion
  std::array<double, 9> k{};            // intrinsics, row by row
  std::array<double, 9> r{};            // rectification
  std::array<double, 12> p{};           // projection
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
  DOPPEL_MESSAGE("sensor_msgs/msg/CameraInfo", header, height, width, distortion_model, d, k, r, p, binning_x,
                 binning_y, roi)
};

// V, degrees Celsius, A (negative: discharging), A h, percentage from 0 to 1; NaN: not measured.
struct BatteryState {
  static constexpr std::uint8_t POWER_SUPPLY_STATUS_UNKNOWN = 0, POWER_SUPPLY_STATUS_CHARGING = 1,
                                POWER_SUPPLY_STATUS_DISCHARGING = 2, POWER_SUPPLY_STATUS_NOT_CHARGING = 3,
                                POWER_SUPPLY_STATUS_FULL = 4, POWER_SUPPLY_HEALTH_UNKNOWN = 0,
                                POWER_SUPPLY_HEALTH_GOOD = 1, POWER_SUPPLY_HEALTH_OVERHEAT = 2,
                                POWER_SUPPLY_HEALTH_DEAD = 3, POWER_SUPPLY_HEALTH_OVERVOLTAGE = 4,
                                POWER_SUPPLY_HEALTH_UNSPEC_FAILURE = 5, POWER_SUPPLY_HEALTH_COLD = 6,
                                POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE = 7,
                                POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE = 8,
                                POWER_SUPPLY_TECHNOLOGY_UNKNOWN = 0, POWER_SUPPLY_TECHNOLOGY_NIMH = 1,
                                POWER_SUPPLY_TECHNOLOGY_LION = 2, POWER_SUPPLY_TECHNOLOGY_LIPO = 3,
                                POWER_SUPPLY_TECHNOLOGY_LIFE = 4, POWER_SUPPLY_TECHNOLOGY_NICD = 5,
                                POWER_SUPPLY_TECHNOLOGY_LIMN = 6, POWER_SUPPLY_TECHNOLOGY_TERNARY = 7,
                                POWER_SUPPLY_TECHNOLOGY_VRLA = 8;
  std_msgs::msg::Header header;
  float voltage = 0, temperature = 0, current = 0, charge = 0, capacity = 0, design_capacity = 0,
        percentage = 0;
  std::uint8_t power_supply_status = 0, power_supply_health = 0, power_supply_technology = 0;
  bool present = false;
  std::vector<float> cell_voltage, cell_temperature;
  std::string location, serial_number;
  DOPPEL_MESSAGE("sensor_msgs/msg/BatteryState", header, voltage, temperature, current, charge, capacity,
                 design_capacity, percentage, power_supply_status, power_supply_health,
                 power_supply_technology, present, cell_voltage, cell_temperature, location, serial_number)
  DOPPEL_CONSTANTS(POWER_SUPPLY_STATUS_UNKNOWN, POWER_SUPPLY_STATUS_CHARGING, POWER_SUPPLY_STATUS_DISCHARGING,
                   POWER_SUPPLY_STATUS_NOT_CHARGING, POWER_SUPPLY_STATUS_FULL, POWER_SUPPLY_HEALTH_UNKNOWN,
                   POWER_SUPPLY_HEALTH_GOOD, POWER_SUPPLY_HEALTH_OVERHEAT, POWER_SUPPLY_HEALTH_DEAD,
                   POWER_SUPPLY_HEALTH_OVERVOLTAGE, POWER_SUPPLY_HEALTH_UNSPEC_FAILURE,
                   POWER_SUPPLY_HEALTH_COLD, POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE,
                   POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE, POWER_SUPPLY_TECHNOLOGY_UNKNOWN,
                   POWER_SUPPLY_TECHNOLOGY_NIMH, POWER_SUPPLY_TECHNOLOGY_LION, POWER_SUPPLY_TECHNOLOGY_LIPO,
                   POWER_SUPPLY_TECHNOLOGY_LIFE, POWER_SUPPLY_TECHNOLOGY_NICD, POWER_SUPPLY_TECHNOLOGY_LIMN,
                   POWER_SUPPLY_TECHNOLOGY_TERNARY, POWER_SUPPLY_TECHNOLOGY_VRLA)
};

struct ChannelFloat32 {
  std::string name;
  std::vector<float> values;
  DOPPEL_MESSAGE("sensor_msgs/msg/ChannelFloat32", name, values)
};

struct FluidPressure {
  std_msgs::msg::Header header;
  double fluid_pressure = 0, variance = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/FluidPressure", header, fluid_pressure, variance)
};

// Lux.
struct Illuminance {
  std_msgs::msg::Header header;
  double illuminance = 0, variance = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/Illuminance", header, illuminance, variance)
};

struct Imu {
  std_msgs::msg::Header header;
  geometry_msgs::msg::Quaternion orientation;
  std::array<double, 9> orientation_covariance{};
  geometry_msgs::msg::Vector3 angular_velocity;
  std::array<double, 9> angular_velocity_covariance{};
  geometry_msgs::msg::Vector3 linear_acceleration;
  std::array<double, 9> linear_acceleration_covariance{};
  DOPPEL_MESSAGE("sensor_msgs/msg/Imu", header, orientation, orientation_covariance, angular_velocity,
                 angular_velocity_covariance, linear_acceleration, linear_acceleration_covariance)
};

struct Joy {
  std_msgs::msg::Header header;
  std::vector<float> axes;
  std::vector<std::int32_t> buttons;
  DOPPEL_MESSAGE("sensor_msgs/msg/Joy", header, axes, buttons)
};

struct JoyFeedback {
  static constexpr std::uint8_t TYPE_LED = 0, TYPE_RUMBLE = 1, TYPE_BUZZER = 2;
  std::uint8_t type = 0, id = 0;
  float intensity = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/JoyFeedback", type, id, intensity)
  DOPPEL_CONSTANTS(TYPE_LED, TYPE_RUMBLE, TYPE_BUZZER)
};

struct JoyFeedbackArray {
  std::vector<JoyFeedback> array;
  DOPPEL_MESSAGE("sensor_msgs/msg/JoyFeedbackArray", array)
};

struct LaserEcho {
  std::vector<float> echoes;
  DOPPEL_MESSAGE("sensor_msgs/msg/LaserEcho", echoes)
};

struct LaserScan {
  std_msgs::msg::Header header;
  float angle_min = 0, angle_max = 0, angle_increment = 0, time_increment = 0, scan_time = 0, range_min = 0,
        range_max = 0;
  std::vector<float> ranges, intensities;
  DOPPEL_MESSAGE("sensor_msgs/msg/LaserScan", header, angle_min, angle_max, angle_increment, time_increment,
                 scan_time, range_min, range_max, ranges, intensities)
};

struct MagneticField {
  std_msgs::msg::Header header;
  geometry_msgs::msg::Vector3 magnetic_field;
  std::array<double, 9> magnetic_field_covariance{};
  DOPPEL_MESSAGE("sensor_msgs/msg/MagneticField", header, magnetic_field, magnetic_field_covariance)
};

struct MultiDOFJointState {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  std::vector<geometry_msgs::msg::Transform> transforms;
  std::vector<geometry_msgs::msg::Twist> twist;
  std::vector<geometry_msgs::msg::Wrench> wrench;
  DOPPEL_MESSAGE("sensor_msgs/msg/MultiDOFJointState", header, joint_names, transforms, twist, wrench)
};

struct MultiEchoLaserScan {
  std_msgs::msg::Header header;
  float angle_min = 0, angle_max = 0, angle_increment = 0, time_increment = 0, scan_time = 0, range_min = 0,
        range_max = 0;
  std::vector<LaserEcho> ranges, intensities;
  DOPPEL_MESSAGE("sensor_msgs/msg/MultiEchoLaserScan", header, angle_min, angle_max, angle_increment,
                 time_increment, scan_time, range_min, range_max, ranges, intensities)
};

struct NavSatStatus {
  static constexpr std::int8_t STATUS_UNKNOWN = -2, STATUS_NO_FIX = -1, STATUS_FIX = 0, STATUS_SBAS_FIX = 1,
                               STATUS_GBAS_FIX = 2;
  static constexpr std::uint16_t SERVICE_UNKNOWN = 0, SERVICE_GPS = 1, SERVICE_GLONASS = 2,
                                 SERVICE_COMPASS = 4, SERVICE_GALILEO = 8;
  std::int8_t status = -2;
  std::uint16_t service = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/NavSatStatus", status, service)
  DOPPEL_CONSTANTS(STATUS_UNKNOWN, STATUS_NO_FIX, STATUS_FIX, STATUS_SBAS_FIX, STATUS_GBAS_FIX,
                   SERVICE_UNKNOWN, SERVICE_GPS, SERVICE_GLONASS, SERVICE_COMPASS, SERVICE_GALILEO)
};

// Degrees, and m above the WGS 84 ellipsoid.
struct NavSatFix {
  static constexpr std::uint8_t COVARIANCE_TYPE_UNKNOWN = 0, COVARIANCE_TYPE_APPROXIMATED = 1,
                                COVARIANCE_TYPE_DIAGONAL_KNOWN = 2, COVARIANCE_TYPE_KNOWN = 3;
  std_msgs::msg::Header header;
  NavSatStatus status;
  double latitude = 0, longitude = 0, altitude = 0;
  std::array<double, 9> position_covariance{};
  std::uint8_t position_covariance_type = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/NavSatFix", header, status, latitude, longitude, altitude,
                 position_covariance, position_covariance_type)
  DOPPEL_CONSTANTS(COVARIANCE_TYPE_UNKNOWN, COVARIANCE_TYPE_APPROXIMATED, COVARIANCE_TYPE_DIAGONAL_KNOWN,
                   COVARIANCE_TYPE_KNOWN)
};

struct PointCloud {
  std_msgs::msg::Header header;
  std::vector<geometry_msgs::msg::Point32> points;
  std::vector<ChannelFloat32> channels;
  DOPPEL_MESSAGE("sensor_msgs/msg/PointCloud", header, points, channels)
};

struct PointField {
  static constexpr std::uint8_t INT8 = 1, UINT8 = 2, INT16 = 3, UINT16 = 4, INT32 = 5, UINT32 = 6,
                                FLOAT32 = 7, FLOAT64 = 8;
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
  std::uint32_t count = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/PointField", name, offset, datatype, count)
  DOPPEL_CONSTANTS(INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64)
};

struct PointCloud2 {
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<PointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
  DOPPEL_MESSAGE("sensor_msgs/msg/PointCloud2", header, height, width, fields, is_bigendian, point_step,
                 row_step, data, is_dense)
};

struct Range {
  static constexpr std::uint8_t ULTRASOUND = 0, INFRARED = 1;
  std_msgs::msg::Header header;
  std::uint8_t radiation_type = 0;
  float field_of_view = 0, min_range = 0, max_range = 0, range = 0, variance = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/Range", header, radiation_type, field_of_view, min_range, max_range, range,
                 variance)
  DOPPEL_CONSTANTS(ULTRASOUND, INFRARED)
};

// 0 to 1.
struct RelativeHumidity {
  std_msgs::msg::Header header;
  double relative_humidity = 0, variance = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/RelativeHumidity", header, relative_humidity, variance)
};

// Degrees Celsius.
struct Temperature {
  std_msgs::msg::Header header;
  double temperature = 0, variance = 0;
  DOPPEL_MESSAGE("sensor_msgs/msg/Temperature", header, temperature, variance)
};

struct TimeReference {
  std_msgs::msg::Header header;
  builtin_interfaces::msg::Time time_ref;
  std::string source;
  DOPPEL_MESSAGE("sensor_msgs/msg/TimeReference", header, time_ref, source)
};

}  // namespace doppel::sensor_msgs::msg

namespace doppel::sensor_msgs::srv {

struct SetCameraInfo {
  struct Request {
    msg::CameraInfo camera_info;
    DOPPEL_MESSAGE("sensor_msgs/srv/SetCameraInfo_Request", camera_info)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("sensor_msgs/srv/SetCameraInfo_Response", success, status_message)
  };
};

}  // namespace doppel::sensor_msgs::srv
