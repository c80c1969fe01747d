#pragma once
// An engine over a hand-made robot, and short hands for the tests of this room.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "doppel/kinematics/dynamics.h"
#include "doppel/kinematics/test/robots.h"
#include "doppel/physics/engine.h"

namespace doppel::test {

inline World empty_space(double step = 1e-3, Integrator integrator = Integrator::euler) {
  World world;
  world.ground = false;
  world.step = from_seconds(step);
  world.integrator = integrator;
  return world;
}

struct Rig {
  explicit Rig(const RobotDescription& robot, const World& in = empty_space(), EngineOptions options = {},
               BaseKind base = BaseKind::fixed)
      : world(in), model(compile_model(robot, base, diagnostics)) {
    engine = make_mujoco_engine(robot, model, world, options, diagnostics);
  }

  [[nodiscard]] int joint(const std::string& name) const { return model.find_joint(name); }
  [[nodiscard]] double q(const std::string& name) const {
    return engine->q()[static_cast<std::size_t>(model.joints[joint(name)].q)];
  }
  [[nodiscard]] double v(const std::string& name) const {
    return engine->v()[static_cast<std::size_t>(model.joints[joint(name)].v)];
  }
  [[nodiscard]] double effort(const std::string& name) const {
    return engine->drive_effort()[static_cast<std::size_t>(joint(name))];
  }
  void set_state(const std::vector<double>& q0, std::vector<double> v0 = {}) {
    v0.resize(static_cast<std::size_t>(model.nv), 0.0);
    engine->set_state(q0, v0);
  }
  void run(double seconds) {
    const auto steps = from_seconds(seconds) / world.step;
    for (std::int64_t i = 0; i < steps; ++i) engine->step();
    ASSERT_FALSE(engine->diverged());
  }
  void hold_all() {
    for (const std::string& name : model.driven_joint_names())
      engine->set_drive(joint(name), DriveMode::position);
  }

  Diagnostics diagnostics;
  World world;
  Model model;
  std::unique_ptr<Engine> engine;
};

inline WorldObject make_object(const std::string& name, const Geometry& shape,
                               const Eigen::Vector3d& position, double mass) {
  WorldObject object;
  object.name = name;
  object.shape = shape;
  object.X_WO.translation() = position;
  object.mass = mass;
  return object;
}

// A robot that does nothing, where only the world matters.
inline RobotDescription make_post() {
  RobotDescription robot;
  robot.name = "post";
  robot.links = {make_frame("post")};
  return robot;
}

}  // namespace doppel::test
