// Sensors of models of SDF, and the frames of their messages.
#include "doppel/scenario/compile/robot_sensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

constexpr const char* kWall = R"(<sdf version='1.9'><model name='wall'><static>true</static>
  <link name='body'>
    <sensor name='eye' type='camera'><pose>0 0 1 0 0.5 0</pose><update_rate>5</update_rate></sensor>
    <sensor name='scan' type='gpu_lidar'/>
  </link>
</model></sdf>)";

TEST(RobotSensors, SensorsOfSdfModelHavePosesAndFrames) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  CollisionMeshes meshes;
  const SdfWorld world = parse_sdf(kWall, "wall.sdf", "", resolver, diagnostics);
  const SdfModel& model = world.models.at(0);
  const ModelInstance instance = make_instance(model, "", meshes, diagnostics);
  const RobotSensors found = find_sensors(model, *instance.model, diagnostics);
  ASSERT_EQ(found.sensors.size(), 2U);
  EXPECT_EQ(found.sensors[0].description.name, "eye");
  EXPECT_EQ(found.sensors[0].description.source.line, 3);
  EXPECT_EQ(found.sensors[0].frame, "body_optical_frame");
  EXPECT_NEAR(found.sensors[0].description.X_LS.translation().z(), 1, 1e-12);
  EXPECT_EQ(found.sensors[1].frame, "body");
  ASSERT_EQ(found.frames.size(), 1U);
  // The optical axis is the x axis of the sensor, which looks down by 0.5 rad.
  EXPECT_NEAR((found.frames[0].X_PF.linear() * Eigen::Vector3d::UnitZ() -
               Eigen::Vector3d(std::cos(0.5), 0, -std::sin(0.5)))
                  .norm(),
              0, 1e-9);
}

}  // namespace
}  // namespace doppel
