#pragma once
// A sensor as it is described, whatever the spelling: <gazebo><sensor> of a URDF, <sensor> of an SDF link or joint, with
// the plugins of Gazebo classic inside or outside of it, in their classic, ignition and gz names. Source: SDFormat
// 1.11, sensor; gazebo_plugins of gazebo_ros_pkgs 3; gz-sensors 8.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/base/math/pose.h"
#include "doppel/export.h"

namespace doppel {

// Of the values below, which an edit changes or not.
inline bool operator==(const Pose& a, const Pose& b) {
  return a.matrix() == b.matrix();
}

// Noise of one channel, in its unit. Source: SDFormat, noise; gz-sensors, GaussianNoiseModel.
struct DOPPEL_API NoiseDescription {
  double mean = 0, stddev = 0;            // of each sample
  double bias_mean = 0, bias_stddev = 0;  // of the constant part, chosen once, of either sign
  double precision = 0;                   // values are rounded to its multiples; 0: not rounded
  double walk_stddev = 0, walk_time = 0;  // of the bias's slow change; its correlation time in s; 0: none
  [[nodiscard]] bool any() const {
    return mean != 0 || stddev != 0 || bias_mean != 0 || bias_stddev != 0 || precision != 0 ||
           walk_stddev != 0;
  }
  bool operator==(const NoiseDescription&) const = default;
};

// The function by which a lens maps an angle theta from its axis to a distance r = f g(theta) from the centre
// of the picture.
enum class LensKind {
  pinhole,        // g = tan(theta)
  stereographic,  // 2 tan(theta / 2)
  equidistant,    // theta
  equisolid,      // 2 sin(theta / 2)
  orthographic,   // sin(theta)
  custom,         // c1 fun(theta / c2 + c3)
};

struct LensDescription {
  LensKind kind = LensKind::pinhole;
  bool scale_to_hfov = true;                    // false: `f` is as written
  double c1 = 1, c2 = 1, c3 = 0, f = 1;         // of a custom one
  std::string function = "tan";                 // "sin", "tan", "id"
  double cutoff_angle = 1.5707963267948966;     // rad from the axis, beyond which nothing is seen
  std::array<double, 5> distortion{};           // k1 k2 p1 p2 k3 of a pinhole (ROS's order), plumb_bob
  Eigen::Vector2d distortion_centre{0.5, 0.5};  // of the width and height
  // The values of <lens><intrinsics>: pixels; s: skew.
  struct Intrinsics {
    double fx = 0, fy = 0, cx = 0, cy = 0, s = 0;
    bool operator==(const Intrinsics&) const = default;
  };
  std::optional<Intrinsics> intrinsics;
  bool operator==(const LensDescription&) const = default;
};

// The content of the pictures: each kind publishes what its kind of Gazebo's sensors does.
enum class CameraKind { colour, depth, rgbd, segmentation, boundingbox };
// <box_type>: around the visible pixels, around the whole object in the picture, or oriented in space.
enum class BoxKind { visible_2d, full_2d, oriented_3d };

struct CameraDescription {
  CameraKind kind = CameraKind::colour;
  std::string name;                             // of one camera of several (multicamera); else empty
  Pose X_SC = Pose::Identity();                 // the camera in the sensor, x forward
  int width = 320, height = 240;                // pixels
  std::string format = "R8G8B8";                // SDF's name
  double hfov = 1.047;                          // rad
  double near = 0.1, far = 100;                 // m
  std::optional<double> depth_near, depth_far;  // m, of depths; else near and far
  int samples = 1;                              // of a pixel: <anti_aliasing>
  LensDescription lens;
  NoiseDescription noise;  // of colours, in parts of full scale
  double baseline = 0;     // m: x of the right camera of a stereo pair, in P[3]
  // doppel's own tags.
  Eigen::Vector3d depth_noise = Eigen::Vector3d::Zero();  // a, b, c: sigma = a + b z + c z^2, m
  double dropout = 0;                                     // probability that a depth is missing
  double edge_mixing = 0;      // probability that a depth beside an edge is between both sides
  double rolling_shutter = 0;  // s from the first row to the last
  double exposure = 1;         // factor of the light
  BoxKind boxes = BoxKind::visible_2d;
  bool panoptic = false;  // <segmentation_type>: instances of classes, too
  bool operator==(const CameraDescription&) const = default;
};

// A range of equally spaced directions: (max - min) / (n - 1).
struct ScanRange {
  int samples = 1;
  double resolution = 1;    // results per sample; n = samples * resolution
  double min = 0, max = 0;  // rad
  bool operator==(const ScanRange&) const = default;
};
struct LidarDescription {
  ScanRange horizontal{640, 1, -1.5707963267948966, 1.5707963267948966}, vertical{1, 1, 0, 0};
  double near = 0.1, far = 30, resolution = 0;  // m
  NoiseDescription noise;                       // m
  double dropout = 0;                           // probability that a range is missing
  bool moving = false;                          // each ray at its own time: the sensor moves during its scan
  double intensity_minimum = 0;                 // min_intensity of the classic plugins
  bool operator==(const LidarDescription&) const = default;
};

// The nearest distance within a cone or pyramid.
struct RangeDescription {
  double field_of_view = 0.2;   // rad, whole
  double near = 0.02, far = 4;  // m
  bool ultrasound = true;       // radiation_type
  LidarDescription rays;        // with which it is measured
  bool operator==(const RangeDescription&) const = default;
};

enum class OrientationReference { world_enu, start, grav_up, ned, nwu, custom };
struct ImuDescription {
  std::array<NoiseDescription, 3> angular_velocity, linear_acceleration;  // rad/s, m/s^2
  NoiseDescription orientation;  // rad, of roll, pitch, yaw: classic's plugin
  bool orientation_enabled = true;
  OrientationReference reference = OrientationReference::start;
  Eigen::Vector3d custom_rpy = Eigen::Vector3d::Zero();
  bool operator==(const ImuDescription&) const = default;
};

enum class WrenchFrame { parent, child, sensor };
struct ForceTorqueDescription {
  WrenchFrame frame = WrenchFrame::child;
  bool parent_to_child = false;                   // <measure_direction>; else child_to_parent
  std::array<NoiseDescription, 3> force, torque;  // N, N m
  bool operator==(const ForceTorqueDescription&) const = default;
};

struct ContactDescription {
  std::vector<std::string> collisions;  // as written, plain or lumped; empty: all of the link
  bool bumper = false;                  // ContactsState of classic's plugin in place of Contacts
  bool operator==(const ContactDescription&) const = default;
};

// Sensors of the environment: position by satellites, field, height, pressure, and what is in sight.
enum class EnvironmentKind { navsat, magnetometer, altimeter, air_pressure, logical_camera, pose };
struct EnvironmentDescription {
  EnvironmentKind kind = EnvironmentKind::navsat;
  std::array<NoiseDescription, 4> noise;           // in the order of SDF's elements
  double near = 0, far = 0, hfov = 0, aspect = 1;  // of a logical camera
  double reference = 0;                            // m, reference_altitude of air pressure
  bool operator==(const EnvironmentDescription&) const = default;
};

// All that is described, wherever it is written.
struct DOPPEL_API SensorProperties {
  std::string name;
  std::string type;              // as written: "gpu_lidar"
  std::string link;              // to which it is fixed
  std::string joint;             // of a force_torque sensor on a joint; else empty
  Pose X_LS = Pose::Identity();  // the sensor in the link, or in the child link of the joint
  double rate = 0;               // Hz; 0: every step
  double latency = 0;            // s from the sample to its message
  std::string topic;             // as written; empty: the kind's own
  std::string info_topic;        // of camera_info; empty: beside the picture
  // Topics that a plugin or its <remapping> gives: by output ("image", "camera_info", "depth", "points", "scan").
  std::vector<std::pair<std::string, std::string>> topics;
  std::string name_space;         // <ros><namespace>, below that of the robot
  std::string frame;              // of messages, as written; empty: the link, or its optical frame
  bool frame_is_optical = false;  // written in a tag that says so (optical_frame_id)
  bool best_effort = false;       // by <qos>
  bool visualize = false;
  bool points_only = false;  // of plugins that publish points alone
  std::variant<std::vector<CameraDescription>, LidarDescription, RangeDescription, ImuDescription,
               ForceTorqueDescription, ContactDescription, EnvironmentDescription>
      what;  // several cameras: a multicamera
  bool operator==(const SensorProperties&) const = default;
};
struct DOPPEL_API SensorDescription : SensorProperties {
  SourceLocation source;
};

}  // namespace doppel
