#pragma once
// A robot for tests, without any file: a chain of revolute joints with the given limits.

#include <string>
#include <vector>

#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct FakeJoint {
  std::string name;
  JointType type = JointType::revolute;
  double lower = -3.0, upper = 3.0;                 // rad or m
  double velocity = kInfinity, effort = kInfinity;  // rad/s, N m
  std::string mimics = "";                          // leader's name; empty: none
};

inline Model fake_robot(const std::vector<FakeJoint>& joints, const std::string& name = "fake") {
  Model model;
  model.name = name;
  model.links.push_back({"base_link", -1, {}});
  for (const FakeJoint& spec : joints) {
    ModelJoint joint;
    joint.name = spec.name;
    joint.type = spec.type;
    joint.parent_link = static_cast<int>(model.links.size()) - 1;
    joint.child_link = static_cast<int>(model.links.size());
    if (spec.type != JointType::fixed) {
      joint.q = model.nq++;
      joint.v = model.nv++;
      joint.nq = joint.nv = 1;
    }
    const bool bounded = spec.type == JointType::revolute || spec.type == JointType::prismatic;
    joint.lower = bounded ? spec.lower : -kInfinity;
    joint.upper = bounded ? spec.upper : kInfinity;
    joint.velocity = spec.velocity;
    joint.effort = spec.effort;
    if (!spec.mimics.empty()) joint.mimic_leader = model.find_joint(spec.mimics);
    model.links.push_back({spec.name + "_link", static_cast<int>(model.joints.size()), {}});
    model.joints.push_back(joint);
  }
  return model;
}

}  // namespace doppel
