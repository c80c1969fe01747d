#pragma once
// A rig of sensors of light on a robot before a wall, and what comes on its topics.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/sensors/rigs/light_rig.h"
#include "header_time.h"

namespace doppel::test {

inline constexpr double kWall = 3;  // m from the robot to the face of the box before it

inline RobotDescription pole() {
  RobotDescription robot;
  robot.name = "pole";
  robot.links.push_back(make_link("base", 1, {0, 0, 0}, {1e-3, 1e-3, 1e-3}));
  robot.links.push_back(make_link("head", 1, {0, 0, 0}, {1e-3, 1e-3, 1e-3}));
  robot.joints.push_back(make_joint("neck", JointType::revolute, "base", "head", {0, 0, 1}, {0, 0, 1}));
  limit(robot.joints.back(), -3, 3, 10, 10);
  return robot;
}

inline World room() {
  World world = empty_space();
  world.gravity.setZero();
  WorldObject wall;
  wall.name = "wall";
  wall.shape = Box{{0.2, 20, 20}};
  wall.X_WO.translation() = Eigen::Vector3d(kWall + 0.1, 0, 0);
  world.objects.push_back(wall);
  return world;
}

inline RigSensor sensor_named(const std::string& name, double rate) {
  RigSensor sensor;
  sensor.instance = "pole";
  sensor.link = 1;
  sensor.frame = "head";
  sensor.description.name = name;
  sensor.description.link = "head";
  sensor.description.rate = rate;
  return sensor;
}

inline RigSensor camera(const std::string& name, CameraKind kind, double rate = 30) {
  RigSensor sensor = sensor_named(name, rate);
  CameraDescription description;
  description.kind = kind;
  description.width = 64;
  description.height = 48;
  sensor.description.what = std::vector<CameraDescription>{description};
  return sensor;
}

inline RigSensor lidar(double rate = 10) {
  RigSensor sensor = sensor_named("scan", rate);
  LidarDescription description;
  description.horizontal = {181, 1, -1, 1};
  sensor.description.what = description;
  return sensor;
}

// A rig with its engine, and what comes on its topics.
struct LightTwin {
  Rig world;
  Bus bus;
  Log log;
  std::vector<std::string> lines;
  LightRig rig;
  Node reader{bus, "/reader"};

  explicit LightTwin(const std::vector<RigSensor>& sensors,
                     const RigOptions& options = {.seed = 1, .lockstep = true},
                     const RobotDescription& robot = pole(), const World& in = room())
      : world(robot, in), rig(bus, log, options) {
    log.add_sink([this](const LogLine& line) { lines.push_back(line.text); });
    rig.set_sensors(sensors, *world.engine);
  }
  template <Message M>
  void read(const std::string& topic, std::vector<M>& into) {
    reader.subscribe<M>(topic, [&into](const M& message) { into.push_back(message); });
    bus.spin();
  }
  void run(double seconds) {
    const auto steps = static_cast<int>(std::lround(seconds * 1000));
    for (int i = 0; i < steps; ++i) {
      world.engine->step();
      const Time now = world.engine->time();
      bus.set_now(now);
      rig.after_step(now, *world.engine);
      rig.between_steps(now);
    }
  }
};

}  // namespace doppel::test
