#pragma once
// A rig of physical sensors with its engine, and what comes on its topics.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/sensors/rigs/physical_rig.h"
#include "header_time.h"

namespace doppel::test {

inline RigSensor make_rig_sensor(const std::string& instance, const std::string& link, int index,
                                 const std::string& name, double rate) {
  RigSensor sensor;
  sensor.instance = instance;
  sensor.link = index;
  sensor.frame = link;
  sensor.description.name = name;
  sensor.description.link = link;
  sensor.description.rate = rate;
  return sensor;
}

struct Sensed {
  Sensed(const RobotDescription& robot, const World& in, std::vector<RigSensor> sensors,
         BaseKind base = BaseKind::fixed, std::uint64_t seed = 1)
      : world(robot, in, {}, base), rig(bus, log, RigOptions{seed, false}), sensors_(std::move(sensors)) {
    log.add_sink([this](const LogLine& line) { lines.push_back(line.text); });
  }
  // With the sensors in the present state of the engine.
  void start() { rig.set_sensors(sensors_, *world.engine); }

  template <Message M>
  void read(const std::string& topic, std::vector<M>& into) {
    reader.subscribe<M>(topic, [&into](const M& message) { into.push_back(message); });
    bus.spin();
  }
  void step() {
    rig.before_step(*world.engine);
    world.engine->step();
    const Time now = world.engine->time();
    bus.set_now(now);
    if (now >= rig.next()) rig.publish(*world.engine);
  }
  void run(double seconds) {
    const auto steps = from_seconds(seconds) / world.world.step;
    for (std::int64_t i = 0; i < steps; ++i) step();
    ASSERT_FALSE(world.engine->diverged());
  }

  test::Rig world;
  Bus bus;
  Log log;
  std::vector<std::string> lines;
  PhysicalRig rig;
  Node reader{bus, "/reader"};

 private:
  std::vector<RigSensor> sensors_;
};

inline Eigen::Vector3d vector_of(const geometry_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

}  // namespace doppel::test
