#pragma once
// Robots for tests, built without a file.

#include <random>
#include <string>
#include <vector>

#include "doppel/description/urdf/robot_description.h"

namespace doppel::test {

inline Link make_link(const std::string& name, double mass, const Eigen::Vector3d& com,
                      const Eigen::Vector3d& moments) {
  Link link;
  link.name = name;
  Inertial inertial;
  inertial.mass = mass;
  inertial.origin.xyz = com;
  inertial.ixx = moments.x();
  inertial.iyy = moments.y();
  inertial.izz = moments.z();
  link.inertial = inertial;
  return link;
}

inline Link make_frame(const std::string& name) {
  Link link;
  link.name = name;
  return link;
}

inline Joint make_joint(const std::string& name, JointType type, const std::string& parent,
                        const std::string& child, const Eigen::Vector3d& xyz, const Eigen::Vector3d& axis) {
  Joint joint;
  joint.name = name;
  joint.type = type;
  joint.parent = parent;
  joint.child = child;
  joint.origin.xyz = xyz;
  joint.axis = axis;
  return joint;
}

inline void limit(Joint& joint, double lower, double upper, double effort, double velocity) {
  joint.limits = JointLimits{lower, upper, effort, velocity, true, {}};
}

// A bob of `mass` at `length` below a hinge about y, 2 m above the ground; the rod is massless.
inline RobotDescription make_pendulum(double mass, double length) {
  RobotDescription robot;
  robot.name = "pendulum";
  robot.links = {make_frame("post"), make_link("bob", mass, {0, 0, -length}, {1e-6, 1e-6, 1e-6})};
  robot.joints = {make_joint("swing", JointType::continuous, "post", "bob", {0, 0, 2}, {0, 1, 0})};
  return robot;
}

// Two bobs in series, both hinges about y: the textbook double pendulum (point masses except for 1e-6 kg
// m^2).
inline RobotDescription make_double_pendulum(double m1, double l1, double m2, double l2) {
  RobotDescription robot = make_pendulum(m1, l1);
  robot.links.push_back(make_link("bob2", m2, {0, 0, -l2}, {1e-6, 1e-6, 1e-6}));
  robot.joints.push_back(make_joint("swing2", JointType::continuous, "bob", "bob2", {0, 0, -l1}, {0, 1, 0}));
  return robot;
}

inline Link random_link(const std::string& name, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Link link = make_link(name, 0.2 + 0.1 * unit(random),
                        0.05 * Eigen::Vector3d(unit(random), unit(random), unit(random)),
                        {2e-4 + 5e-5 * unit(random), 2e-4 + 5e-5 * unit(random), 2e-4 + 5e-5 * unit(random)});
  link.inertial->origin.rpy = 3 * Eigen::Vector3d(unit(random), unit(random), unit(random));
  link.inertial->ixy = 2e-5 * unit(random);
  return link;
}

// A chain of the given joints with random axes, offsets and masses, the first joint 0.5 m above the ground.
inline RobotDescription make_random_chain(const std::vector<JointType>& types, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Eigen::Vector3d(unit(random), unit(random), unit(random)); };
  RobotDescription robot;
  robot.name = "random";
  robot.links.push_back(make_frame("base"));
  for (std::size_t i = 0; i < types.size(); ++i) {
    const std::string name = "link" + std::to_string(i);
    const Eigen::Vector3d offset = i == 0 ? Eigen::Vector3d(0, 0, 0.5) : Eigen::Vector3d(0.1 * vector());
    Joint joint =
        make_joint("joint" + std::to_string(i), types[i], robot.links.back().name, name, offset, vector());
    joint.origin.rpy = 3 * vector();
    robot.joints.push_back(joint);
    robot.links.push_back(random_link(name, random));
  }
  return robot;
}

inline std::vector<JointType> six_hinges() {
  return std::vector<JointType>(6, JointType::continuous);
}

}  // namespace doppel::test
