#pragma once
// A small arm with everything that operations change, and overlays as text.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "doppel/description/overlay/overlay.h"

namespace doppel::overlay_test {

// Meshes that operations create are written to a folder of this run, not to the user's cache.
inline const int kCacheIsSet = setenv(
    "XDG_CACHE_HOME", (std::filesystem::temp_directory_path() / "doppel_overlay_test_cache").c_str(), 1);

inline constexpr const char* kArm = R"(<robot name="arm">
  <link name="base"><inertial><origin xyz="0 0 0.1"/><mass value="2"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>
    <visual><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.2 0.3"/></geometry></visual>
    <collision><geometry><cylinder radius="0.1" length="0.3"/></geometry></collision>
    <collision><origin xyz="0.2 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="upper"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0" iyz="0" izz="0.01"/></inertial></link>
  <link name="slide"/>
  <link name="tip"><inertial><mass value="0.5"/><inertia ixx="1e-6" ixy="0" ixz="0" iyy="1e-6" iyz="0" izz="1e-6"/></inertial></link>
  <joint name="J 1" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="-0.570796 0 0"/><axis xyz="1.0 0.0 -0.0"/>
    <limit lower="0" upper="3.141593" effort="100" velocity="100"/></joint>
  <joint name="J 2" type="prismatic"><parent link="upper"/><child link="slide"/>
    <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="100" velocity="100"/></joint>
  <joint name="J 3" type="revolute"><parent link="slide"/><child link="tip"/>
    <axis xyz="0 -0.984808 -0.173648"/><limit lower="0" upper="1.570796" effort="100" velocity="100"/></joint>
  <gazebo reference="J 1"><mu1>0.2</mu1></gazebo>
  <gazebo reference="tip"><mu1>0.2</mu1></gazebo>
  <transmission name="t"><joint name="J 1"/><actuator name="m"/></transmission>
</robot>)";

struct Bench {
  explicit Bench(const std::string& xml = kArm) { description.root = parse_xml(xml, "arm.urdf"); }

  ExpandedDescription description;
  PackageResolver resolver;
  Diagnostics diagnostics;

  std::vector<OperationState> apply(const Overlay& overlay) {
    std::vector<OperationState> states;
    messages.clear();
    for (const OperationOutcome& outcome : apply_overlay(overlay, description, resolver, diagnostics)) {
      states.push_back(outcome.state);
      messages.push_back(outcome.message);
    }
    return states;
  }
  // Each with the fingerprint of the tree after the previous ones, as they are added one by one.
  Overlay stamped(const std::string& yaml) {
    Overlay overlay = parse_overlay(yaml, "arm.overlay.yaml");
    ExpandedDescription now = description;
    for (Operation& operation : overlay.operations) {
      take_fingerprint(operation, now);
      Overlay one;
      one.operations.push_back(operation);
      Diagnostics quiet;
      const auto outcomes = apply_overlay(one, now, resolver, quiet);
      EXPECT_EQ(outcomes[0].state, OperationState::applied)
          << describe(operation.action) << ": " << outcomes[0].message;
    }
    return overlay;
  }
  [[nodiscard]] std::string text() const { return to_xml(description.root); }
  [[nodiscard]] const XmlNode& element(const std::string& kind, const std::string& name) const {
    for (const XmlNode& child : description.root.children) {
      if (child.is(kind) && child.find("name") != nullptr && child.find("name")->value == name) return child;
    }
    throw std::runtime_error("expected a " + kind + " " + name);
  }
  [[nodiscard]] std::string value(const std::string& kind, const std::string& name, const std::string& child,
                                  const std::string& attribute) const {
    const XmlNode* node = element(kind, name).first(child);
    return node != nullptr && node->find(attribute) != nullptr ? node->find(attribute)->value : "none";
  }
  std::vector<std::string> messages;
};

}  // namespace doppel::overlay_test
