#pragma once
// A typed tree of a complete URDF, each element with its place in the user's source. Nothing is repaired
// here; absent values stay absent. Unknown elements are kept as XML text, so that they can be written again.
// Source: the URDF XML specification (ros.org/wiki/urdf/XML), ros2_control's and Gazebo's extensions.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/base/math/pose.h"
#include "doppel/export.h"

namespace doppel {

struct XmlNode;

struct DOPPEL_API Origin {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();  // m
  Eigen::Vector3d rpy = Eigen::Vector3d::Zero();  // rad, fixed axes x y z
  SourceLocation source;                          // unknown: no <origin> was written
  [[nodiscard]] Pose pose() const { return make_pose(xyz, rpy); }
};

struct DOPPEL_API Inertial {
  Origin origin;      // centre of mass and the axes of the tensor, in the link frame
  double mass = 0.0;  // kg
  // kg m^2 about the centre of mass, in the axes of origin
  double ixx = 0, ixy = 0, ixz = 0, iyy = 0, iyz = 0, izz = 0;
  SourceLocation source;
  bool tensor_written = true;  // false: a mass without <inertia>; the moments above are 0 and not used
  [[nodiscard]] Eigen::Matrix3d tensor() const;
};

struct Image {
  std::string uri;   // as written
  std::string path;  // resolved absolute file; empty: not found
};

struct Box {
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
};  // full side lengths, m
struct Cylinder {
  double radius = 0, length = 0;
};  // m; axis z, centred
struct Capsule {
  double radius = 0, length = 0;
};  // m; axis z, centred, length without the caps
struct Sphere {
  double radius = 0;
};  // m
struct MeshGeometry {
  std::string uri;  // as written: "package://p/meshes/a.stl"
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  std::string path;  // resolved absolute file; empty: not found
  // Only the part of the file with this name; empty: the whole file.
  std::string submesh = {};
  bool center_submesh = false;  // the part is moved so that the centre of its bounding box is the origin
};
// The kinds below are those of SDF; URDF has none of them.
struct Ellipsoid {
  Eigen::Vector3d radii = Eigen::Vector3d::Zero();
};  // semi-axes, m
struct Cone {
  double radius = 0, length = 0;
};  // m; axis z, centred: the base is at -length / 2, the tip at +length / 2
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of any length but 0; the solid is on the other side
  Eigen::Vector2d size = Eigen::Vector2d::Ones();     // m, of what is drawn; what collides has no border
};
struct Extrusion {
  std::vector<Eigen::Vector2d> outline;  // m; a convex polygon, counter-clockwise
  double height = 0;                     // m, along z from 0
};
struct HeightField;  // heightmap.h
// A terrain; its surface is seen, and collides, from above.
struct Heightmap {
  struct Texture {
    Image diffuse, normal;
    double size = 10;  // m, of one repetition
  };
  // From the texture of this index to the next one.
  struct Blend {
    double height = 0, distance = 0;  // m: where it begins, and after how much more height it is complete
  };
  Image image;
  // m: the extent along x and y, centred, and the height of the brightest pixel above black; a negative height turns
  // the image over, so that the brightest pixel is at 0.
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  std::vector<Texture> textures;  // from the lowest to the highest
  std::vector<Blend> blends;
  std::shared_ptr<const HeightField> field;  // nullptr: the image was not found or cannot be read
};
using Geometry =
    std::variant<Box, Cylinder, Capsule, Sphere, MeshGeometry, Ellipsoid, Cone, Plane, Extrusion, Heightmap>;

// The surface of a collision shape: SDF's <surface>, or mu1, mu2, ... of a URDF's <gazebo>. Absent values are
// not written. Source: SDFormat 1.11, surface.
struct ContactSurface {
  std::optional<double> mu, mu2;         // Coulomb friction along fdir1, and across it (without: mu)
  std::optional<Eigen::Vector3d> fdir1;  // direction of mu, not zero, any length
  std::string fdir1_frame;               // a link in whose axes fdir1 is; empty: those of the collision
  std::optional<double> slip1, slip2;    // m/s per N, along fdir1 and across it
  std::optional<double> torsional_mu;    // Coulomb friction of rotation about the normal ...
  std::optional<double> patch_radius;    // ... of a patch of this radius, m
  std::optional<double> kp, kd;          // stiffness N/m, damping N s/m
  std::optional<double> max_velocity;    // m/s, of the correction of a penetration
  std::optional<double> min_depth;       // m, penetration that is not corrected
  std::optional<double> restitution;     // speed after an impact over that before, 0..1
  std::string shape;                     // <doppel:contact>, "cylinder" or "hull"; empty: chosen
};

struct Material {
  std::string name;
  std::optional<Eigen::Vector4d> rgba;  // 0..1
  std::string texture;                  // URI as written
  std::string texture_path = {};        // of SDF: resolved absolute file; empty: not found
  SourceLocation source;
  // Of SDF: physically based rendering by the metal workflow. Absent values are not written. A map multiplies its
  // value; its channels are those of glTF 2.0 (roughness: green, metalness: blue).
  std::optional<Eigen::Vector4d> emissive = {};          // 0..1
  std::optional<double> roughness = {}, metalness = {};  // 0..1
  Image normal_map = {}, roughness_map = {}, metalness_map = {}, emissive_map = {};
};

struct Visual {
  std::string name;
  Origin origin;
  Geometry geometry;
  std::optional<Material> material;  // with the colour looked up where only a name was given
  SourceLocation source;
};

struct Collision {
  std::string name;
  Origin origin;
  Geometry geometry;
  SourceLocation source;
  ContactSurface surface = {};  // of SDF; a URDF's is in the <gazebo> extension of the link
};

struct Link {
  std::string name;
  std::optional<Inertial> inertial;
  std::vector<Visual> visuals;
  std::vector<Collision> collisions;
  SourceLocation source;
};

enum class JointType { fixed, revolute, continuous, prismatic, floating, planar };

struct JointLimits {
  double lower = 0, upper = 0;             // rad or m; meaningless for continuous
  std::optional<double> effort, velocity;  // N m or N; rad/s or m/s; absent: not written
  bool has_position = false;               // lower or upper was written
  SourceLocation source;
  // URDF 1.2, for planners: ros2_control does not enforce them. Units as in kRateLimits.
  std::optional<double> acceleration = {}, deceleration = {}, jerk = {};
};

// The limits that URDF 1.2 has added: the attribute, its value, its units.
struct RateLimit {
  const char* name;
  std::optional<double> JointLimits::*value;
  const char *angular, *linear;
};
inline constexpr std::array kRateLimits{
    RateLimit{"acceleration", &JointLimits::acceleration, "rad/s^2", "m/s^2"},
    RateLimit{"deceleration", &JointLimits::deceleration, "rad/s^2", "m/s^2"},
    RateLimit{"jerk", &JointLimits::jerk, "rad/s^3", "m/s^3"}};

struct JointDynamics {
  double damping = 0;   // N m s/rad or N s/m
  double friction = 0;  // N m or N, Coulomb
  SourceLocation source;
};

struct SafetyController {
  // rad or m; 1/s; N m s/rad or N s/m.
  double soft_lower_limit = 0, soft_upper_limit = 0, k_position = 0, k_velocity = 0;
  SourceLocation source;
};

struct JointCalibration {
  std::optional<double> rising, falling;  // rad or m
};

struct Mimic {
  std::string joint;
  double multiplier = 1, offset = 0;  // q = multiplier * q_leader + offset; offset in rad or m
  SourceLocation source;
};

struct Joint {
  std::string name;
  JointType type = JointType::fixed;
  std::string parent, child;                        // link names
  Origin origin;                                    // X_PJ at q = 0, in the parent link frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // in the joint frame, as written (not normalised)
  std::optional<JointLimits> limits;
  std::optional<JointDynamics> dynamics;
  std::optional<SafetyController> safety;
  std::optional<JointCalibration> calibration;
  std::optional<Mimic> mimic;
  SourceLocation source, axis_source;
};

// <ros2_control>: a named hardware component and its interfaces. Units of min, max and initial_value are
// those of the interface (control/hardware/hardware.h).
struct HardwareInterfaceDescription {
  std::string name;  // "position"
  std::optional<double> min, max, initial_value;
  std::vector<std::pair<std::string, std::string>> params;  // others
  SourceLocation source;
};

struct HardwareJointDescription {
  std::string name;
  std::vector<HardwareInterfaceDescription> command_interfaces, state_interfaces;
  std::vector<std::pair<std::string, std::string>> params;
  SourceLocation source;
};

struct HardwareDescription {
  std::string name, type;              // type: "system", "actuator", "sensor"
  std::string plugin;                  // "gz_ros2_control/GazeboSimSystem"
  std::string group;                   // components that fail together; empty: none
  std::optional<double> rw_rate;       // Hz, of read and write; none: the controller manager's
  bool is_async = false;               // read and written by a separate thread
  std::optional<int> thread_priority;  // of that thread, SCHED_FIFO
  std::vector<std::pair<std::string, std::string>> params;
  std::vector<HardwareJointDescription> joints, sensors, gpios;
  SourceLocation source, plugin_source;
};

// <gazebo>: kept as XML, with the elements that doppel uses as fields.
struct GazeboPlugin {
  std::string filename, name;
  std::vector<std::string> parameter_files;  // <parameters>, resolved where possible
  std::string xml;                           // the whole element as text
  SourceLocation source;
};

struct GazeboExtension {
  std::string reference;  // link or joint; empty: the whole robot
  std::vector<GazeboPlugin> plugins;
  ContactSurface surface;  // of each collision of the link
  // Of a joint's limit stop: <stopStiffness> (N m/rad or N/m), <stopRestitution> (speed after over before).
  std::optional<double> stop_stiffness, stop_restitution;
  std::optional<bool> self_collide, gravity;
  std::string material;  // "Gazebo/Orange"
  std::string xml;
  std::shared_ptr<const XmlNode>
      node;  // the same with the places of its elements; nullptr: it is not from a file
  SourceLocation source;
};

struct Transmission {
  std::string name, type;
  struct Element {
    std::string name, hardware_interface;
    std::optional<double> mechanical_reduction;
    SourceLocation source;
  };
  std::vector<Element> joints, actuators;
  SourceLocation source;
};

struct DOPPEL_API RobotDescription {
  std::string name;
  std::vector<Link> links;
  std::vector<Joint> joints;
  std::vector<Material> materials;
  std::vector<HardwareDescription> hardware;
  std::vector<GazeboExtension> gazebo;
  std::vector<Transmission> transmissions;
  std::vector<std::pair<std::string, SourceLocation>> unknown;  // XML text of unknown top-level elements
  SourceLocation source;
  std::string xml;  // the complete URDF text, expanded, as /robot_description publishes it

  [[nodiscard]] const Link* find_link(std::string_view link_name) const;
  [[nodiscard]] const Joint* find_joint(std::string_view joint_name) const;
};

// True if the joint's axis is not zero.
DOPPEL_API bool has_direction(const Joint& joint);
// True if the joint has one position: revolute, continuous or prismatic, with a direction.
DOPPEL_API bool is_scalar(const Joint& joint);
// The joint that `joint` mimics. nullptr without <mimic>, or if it has no effect: the named joint does not
// exist, one of the two is not scalar, or the chain of mimics leads back to `joint`.
DOPPEL_API const Joint* leader_of(const RobotDescription& robot, const Joint& joint);

}  // namespace doppel
