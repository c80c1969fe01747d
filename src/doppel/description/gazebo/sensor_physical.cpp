// <imu>, <force_torque>, <contact> and the sensors of the environment.
#include "doppel/description/gazebo/detail/sensor_kinds.h"

namespace doppel {
namespace {

OrientationReference reference_of(const std::string& localization) {
  if (localization == "ENU") return OrientationReference::world_enu;
  if (localization == "NED") return OrientationReference::ned;
  if (localization == "NWU") return OrientationReference::nwu;
  if (localization == "GRAV_UP" || localization == "GRAV_DOWN") return OrientationReference::grav_up;
  return localization == "CUSTOM" ? OrientationReference::custom : OrientationReference::start;
}

constexpr const char* kAxes[] = {"x", "y", "z"};

}  // namespace

void read_imu(const SensorValues& values, SensorDescription& out) {
  ImuDescription imu;
  for (std::size_t i = 0; i < 3; ++i) {
    imu.angular_velocity[i] = values.noise(std::string("imu/angular_velocity/") + kAxes[i] + "/noise");
    imu.linear_acceleration[i] = values.noise(std::string("imu/linear_acceleration/") + kAxes[i] + "/noise");
  }
  imu.orientation_enabled = values.flag("imu/enable_orientation", true);
  imu.reference = reference_of(values.text("imu/orientation_reference_frame/localization"));
  imu.custom_rpy = values.vector("imu/orientation_reference_frame/custom_rpy");
  out.what = imu;
}

void read_force_torque(const SensorValues& values, SensorDescription& out) {
  ForceTorqueDescription wrench;
  const std::string frame = values.text("force_torque/frame", "child");
  wrench.frame = frame == "parent"   ? WrenchFrame::parent
                 : frame == "sensor" ? WrenchFrame::sensor
                                     : WrenchFrame::child;
  wrench.parent_to_child = values.text("force_torque/measure_direction") == "parent_to_child";
  for (std::size_t i = 0; i < 3; ++i) {
    wrench.force[i] = values.noise(std::string("force_torque/force/") + kAxes[i] + "/noise");
    wrench.torque[i] = values.noise(std::string("force_torque/torque/") + kAxes[i] + "/noise");
  }
  out.what = wrench;
}

void read_contact(const SensorValues& values, SensorDescription& out) {
  ContactDescription contact;
  if (const XmlNode* element = values.find("contact"))
    for (const XmlNode& child : element->children)
      if (child.is("collision")) contact.collisions.push_back(child.content());
  if (out.topic.empty()) out.topic = values.text("contact/topic");
  out.what = contact;
}

void read_environment(const SensorValues& values, SensorDescription& out) {
  EnvironmentDescription environment;
  if (out.type == "magnetometer") {
    environment.kind = EnvironmentKind::magnetometer;
    for (std::size_t i = 0; i < 3; ++i)
      environment.noise[i] = values.noise(std::string("magnetometer/") + kAxes[i] + "/noise");
  } else if (out.type == "altimeter") {
    environment.kind = EnvironmentKind::altimeter;
    environment.noise = {values.noise("altimeter/vertical_position/noise"),
                         values.noise("altimeter/vertical_velocity/noise"),
                         {},
                         {}};
  } else if (out.type == "air_pressure") {
    environment.kind = EnvironmentKind::air_pressure;
    environment.noise[0] = values.noise("air_pressure/pressure/noise");
    environment.reference = values.number("air_pressure/reference_altitude", 0);
  } else if (out.type == "logical_camera") {
    environment.kind = EnvironmentKind::logical_camera;
    environment.near = values.number("logical_camera/near", 0);
    environment.far = values.distance_or_all("logical_camera/far", 1);
    environment.aspect = values.number("logical_camera/aspect_ratio", 1);
    environment.hfov = values.number("logical_camera/horizontal_fov", 1);
  } else {
    const std::string root = out.type == "gps" ? "gps" : "navsat";
    const char* of[] = {"/position_sensing/horizontal/noise", "/position_sensing/vertical/noise",
                        "/velocity_sensing/horizontal/noise", "/velocity_sensing/vertical/noise"};
    for (std::size_t i = 0; i < 4; ++i) environment.noise[i] = values.noise(root + of[i]);
  }
  out.what = environment;
}

}  // namespace doppel
