#pragma once
// Robots to convert: those in robots/, and descriptions given as text.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "doppel/description/urdf/load.h"
#include "doppel/review/conversion/mesh_files.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {

struct Converted {
  RobotDescription robot;
  Model model;
};

inline Converted bundled(const std::string& name) {
  const std::filesystem::path robots = std::filesystem::path(DOPPEL_SOURCE_DIR) / "robots";
  PackageResolver resolver;
  resolver.add_bundled(robots);
  const Target target = resolve_target(name, robots);
  resolver.add_context(target.description);
  Diagnostics diagnostics;
  Converted out{load_description(target.description, {{"use_sim", "true"}}, resolver, diagnostics).robot, {}};
  out.model = compile_model(out.robot, BaseKind::fixed, diagnostics);
  return out;
}

inline Converted from_text(const std::string& xml) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  Converted out{parse_urdf(xml, "test.urdf", resolver, diagnostics), {}};
  out.model = compile_model(out.robot, BaseKind::fixed, diagnostics);
  return out;
}

inline std::filesystem::path fresh_folder(const std::string& name) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("doppel_conversion_" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

// Positions within the limits; mimic joints do not follow yet.
inline Eigen::VectorXd random_q(const Model& model, std::mt19937& generator) {
  Eigen::VectorXd q = model.neutral();
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar()) continue;
    const bool limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    q[joint.q] =
        std::uniform_real_distribution(limited ? joint.lower : -3.0, limited ? joint.upper : 3.0)(generator);
  }
  return q;
}

inline bool same(const Pose& a, const Pose& b, double within) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() <= within;
}

// One of everything: primitives, a root without mass, a frame, a mimic joint, a slide, tilted axes, a name
// with characters that XML escapes, and a link and a joint of one name.
inline constexpr const char* kWholeRobot = R"(<robot name="whole">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base_footprint"/>
  <joint name="footprint" type="fixed"><parent link="base_footprint"/><child link="base"/><origin xyz="0.1 0 0.05" rpy="0 0 0.3"/></joint>
  <link name="base">
    <inertial><origin xyz="0.01 0 0.02"/><mass value="2"/><inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.012" iyz="0" izz="0.015"/></inertial>
    <visual><geometry><box size="0.2 0.2 0.1"/></geometry><material name="red"/></visual>
    <collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision>
  </link>
  <joint name="turn &amp; &quot;twist&quot;" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1" rpy="0.1 0.2 0.3"/><axis xyz="0.6 0 0.8"/><limit lower="-1" upper="2" effort="5" velocity="3"/><dynamics damping="0.1" friction="0.02"/></joint>
  <link name="upper">
    <inertial><origin xyz="0 0 0.1" rpy="0.3 0 0"/><mass value="1"/><inertia ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.001"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.03" length="0.2"/></geometry></collision>
    <collision><origin xyz="0 0 0.2"/><geometry><sphere radius="0.04"/></geometry></collision>
  </link>
  <joint name="slide" type="prismatic"><parent link="upper"/><child link="slide"/><origin xyz="0 0.05 0.2"/><axis xyz="0 1 0"/><limit lower="0" upper="0.1" effort="20" velocity="0.5"/></joint>
  <link name="slide"><inertial><mass value="0.3"/><inertia ixx="0.0003" ixy="0" ixz="0" iyy="0.0003" iyz="0" izz="0.0003"/></inertial></link>
  <joint name="follower" type="prismatic"><parent link="upper"/><child link="other_slide"/><origin xyz="0 -0.05 0.2"/><axis xyz="0 -1 0"/><limit lower="0" upper="0.2" effort="20" velocity="0.5"/><mimic joint="slide" multiplier="1.5" offset="0.01"/></joint>
  <link name="other_slide"><inertial><mass value="0.2"/><inertia ixx="0.0003" ixy="0" ixz="0" iyy="0.0003" iyz="0" izz="0.0003"/></inertial></link>
  <joint name="wheel" type="continuous"><parent link="slide"/><child link="carrier"/><axis xyz="1 0 0"/></joint>
  <link name="carrier"/>
  <joint name="carried" type="fixed"><parent link="carrier"/><child link="load"/><origin xyz="0.1 0.2 0.3" rpy="0 0.5 0"/></joint>
  <link name="load"><inertial><mass value="0.4"/><inertia ixx="0.0004" ixy="0" ixz="0" iyy="0.0005" iyz="0" izz="0.0006"/></inertial></link>
  <joint name="tool_joint" type="fixed"><parent link="load"/><child link="tool0"/><origin xyz="0 0 0.1" rpy="0 1 0"/></joint>
  <link name="tool0"/>
  <gazebo reference="base"><mu1>0.7</mu1><kp>1000000</kp><selfCollide>1</selfCollide></gazebo>
  <gazebo><plugin filename="libx.so" name="x"><a>1</a></plugin></gazebo>
</robot>)";

}  // namespace doppel
