#pragma once
// A base on two driven wheels and a ball, of the size of a Pioneer 3-DX, without a file.

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel::test {

struct BaseShape {
  double radius = 0.0975, width = 0.048, track = 0.33;  // m, of the wheels
  double body_mass = 6.73, wheel_mass = 1.1;            // kg
  double friction = 0.8;                                // Coulomb, of the wheels
  double front_friction = 0.8;                          // Coulomb, of the body
  double patch = 0;                                     // m, radius of the wheels' contact patch
  Geometry wheel = Cylinder{0.0975, 0.048};
  Eigen::Vector3d wheel_rpy{std::numbers::pi / 2, 0, 0};  // of the wheel's shape
  std::string contact;                                    // <doppel:contact>
};

inline RobotDescription make_base(const BaseShape& of = {}) {
  RobotDescription robot;
  robot.name = "base";
  Link body = make_link("base_link", of.body_mass, {-0.06, 0, 0.06}, {0.06, 0.1, 0.13});
  body.collisions.push_back({"", {{-0.04, 0, 0.08}, {}, {}}, Box{{0.38, 0.26, 0.12}}, {}});
  robot.links.push_back(body);
  Link ball = make_frame("ball");
  ball.collisions.push_back({"", {}, Sphere{0.0375}, {}});
  robot.links.push_back(ball);
  robot.joints.push_back(make_joint("ball_joint", JointType::fixed, "base_link", "ball",
                                    {-0.2, 0, 0.0375 - of.radius}, {0, 0, 1}));
  GazeboExtension front;
  front.reference = "base_link";
  front.surface.mu = of.front_friction;
  robot.gazebo.push_back(front);
  for (const double side : {1.0, -1.0}) {
    const std::string name = side > 0 ? "left_wheel" : "right_wheel";
    const double along = of.wheel_mass * of.radius * of.radius / 2;
    const double across = of.wheel_mass * (3 * of.radius * of.radius + of.width * of.width) / 12;
    Link wheel = make_link(name, of.wheel_mass, {0, 0, 0}, {across, along, across});
    wheel.collisions.push_back({"", {{}, of.wheel_rpy, {}}, of.wheel, {}});
    robot.links.push_back(wheel);
    robot.joints.push_back(make_joint(name + "_joint", JointType::continuous, "base_link", name,
                                      {0, side * of.track / 2, 0}, {0, 1, 0}));
    JointLimits limits;
    limits.effort = 20.0;
    limits.velocity = 12.3;
    robot.joints.back().limits = limits;
    GazeboExtension extension;
    extension.reference = name;
    extension.surface.mu = of.friction;
    if (of.patch > 0) extension.surface.patch_radius = of.patch;
    extension.surface.shape = of.contact;
    robot.gazebo.push_back(extension);
  }
  return robot;
}

// The base in a world, on its wheels, with velocity drives.
struct DrivenBase : Rig {
  explicit DrivenBase(const RobotDescription& description)
      : Rig(description, {}, options_for(Pose::Identity()), BaseKind::floating) {}
  explicit DrivenBase(const BaseShape& of = {}, const World& in = {}, const Pose& X_WB = Pose::Identity(),
                      const std::string& with_engine = kDefaultEngine)
      : Rig(make_base(of), in, options_for(X_WB), BaseKind::floating, with_engine) {
    for (const char* name : {"left_wheel_joint", "right_wheel_joint"})
      robot.set_drive(joint(name), DriveMode::velocity);
  }
  static InstanceOptions options_for(const Pose& X_WB) {
    InstanceOptions out;
    out.X_WR = X_WB;
    out.set_on_ground = true;
    return out;
  }
  void drive(double left, double right) {  // rad/s
    robot.set_target(joint("left_wheel_joint"), left);
    robot.set_target(joint("right_wheel_joint"), right);
  }
  [[nodiscard]] double angle(const char* wheel) const { return q(wheel); }
  // rad in the plane, continuous over turns if it is read at least once in each half of a turn.
  double heading() {
    const Eigen::Matrix3d R = robot.base_pose().linear();
    const double now = std::atan2(R(1, 0), R(0, 0));
    turned_ += std::remainder(now - turned_, 2 * std::numbers::pi);
    return turned_;
  }
  [[nodiscard]] Eigen::Vector3d position() const { return robot.base_pose().translation(); }

 private:
  double turned_ = 0;
};

// A wheel about z as a prism of `sides` corners on the circle, in a file.
inline MeshGeometry make_wheel_mesh(double radius, double width, int sides, const std::string& name) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / (name + ".obj")).string();
  std::ofstream file(path);
  file.precision(17);
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    for (const double z : {-width / 2, width / 2})
      file << "v " << radius * std::cos(angle) << ' ' << radius * std::sin(angle) << ' ' << z << '\n';
  }
  for (int i = 0; i < sides; ++i) {
    const int a = 2 * i + 1, b = a + 1, c = 2 * ((i + 1) % sides) + 1, d = c + 1;
    file << "f " << a << ' ' << c << ' ' << d << "\nf " << a << ' ' << d << ' ' << b << '\n';
    if (i > 0 && i + 1 < sides) file << "f 1 " << c << ' ' << a << "\nf 2 " << b << ' ' << d << '\n';
  }
  return {path, Eigen::Vector3d::Ones(), path};
}

}  // namespace doppel::test
