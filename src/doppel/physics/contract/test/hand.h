#pragma once
// A hand on a vertical slide with two fingers.

#include <cmath>
#include <string>

#include "doppel/robot/kinematics/test/robots.h"

namespace doppel::test {

struct HandShape {
  double grip = 4;        // N, the most that a finger presses with
  bool coupled = true;    // the right finger mimics the left one, whose effort they share
  double friction = 0.8;  // Coulomb, of the fingers
  double tip = 0.02;      // m, edge of a fingertip's face
};

// Closed by `left` from 0, where the fingertips are 60 mm apart, to 0.03; `lift` is 0 with the tips at z = 20 mm.
inline RobotDescription make_hand(const HandShape& of = {}) {
  RobotDescription robot;
  robot.name = "hand";
  robot.links = {make_frame("rail"), make_link("palm", 0.2, {0, 0, 0}, {1e-4, 1e-4, 1e-4})};
  robot.joints = {make_joint("lift", JointType::prismatic, "rail", "palm", {0, 0, 0.1}, {0, 0, 1})};
  limit(robot.joints[0], 0, 0.3, 50, 0.2);
  for (const int side : {-1, 1}) {
    const std::string name = side < 0 ? "left" : "right";
    Link finger = make_link(name + " finger", 0.02, {0, 0, -0.08}, {5e-6, 5e-6, 5e-6});
    finger.collisions.push_back({"", {{0, 0, -0.08}, {}, {}}, Box{{of.tip, 0.004, of.tip}}, {}});
    robot.links.push_back(finger);
    robot.joints.push_back(make_joint(name, JointType::prismatic, "palm", finger.name, {0, 0.032 * side, 0},
                                      {0, -1.0 * side, 0}));
    limit(robot.joints.back(), 0, 0.03, of.grip, 0.1);
    GazeboExtension surface;
    surface.reference = finger.name;
    surface.surface.mu = of.friction;
    robot.gazebo.push_back(surface);
  }
  if (of.coupled) robot.joints.back().mimic = Mimic{"left", 1, 0, {}};
  return robot;
}

}  // namespace doppel::test
