#pragma once
// An engine with a hand-made robot, and shorthands for the tests of this module.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "doppel/physics/contract/engine_modules.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel::test {

inline World empty_space(double step = 1e-3, Integrator integrator = Integrator::euler) {
  World world;
  world.ground = false;
  world.step = from_seconds(step);
  world.integrator = integrator;
  return world;
}

// A pair that never collides, by name.
struct NamedPair {
  std::string link_a, link_b, reason;
  double depth;
};

// A robot and the objects of a world, in the default engine or in another one.
struct Rig {
  explicit Rig(const RobotDescription& description, const World& in = empty_space(),
               InstanceOptions options = {}, BaseKind base = BaseKind::fixed,
               const std::string& with_engine = kDefaultEngine)
      : world(in),
        shared(std::make_shared<const Model>(compile_model(description, base, diagnostics))),
        model(*shared) {
    if (!in.X_WR.isApprox(Pose::Identity())) options.X_WR = in.X_WR;
    options.gravity = in.gravity;
    std::vector<ModelInstance> instances{make_instance(std::make_shared<const RobotDescription>(description),
                                                       shared, options, meshes, diagnostics)};
    for (const WorldObject& object : in.objects)
      instances.push_back(make_instance(object, meshes, diagnostics));
    engine = compile_world(with_engine, in, std::move(instances), diagnostics)->make_engine();
    robot = engine->instance(0);
  }

  [[nodiscard]] int joint(const std::string& name) const { return model.find_joint(name); }
  [[nodiscard]] double q(const std::string& name) const {
    return robot.q()[static_cast<std::size_t>(model.joints[joint(name)].q)];
  }
  [[nodiscard]] double v(const std::string& name) const {
    return robot.v()[static_cast<std::size_t>(model.joints[joint(name)].v)];
  }
  [[nodiscard]] double effort(const std::string& name) const {
    return robot.drive_effort()[static_cast<std::size_t>(joint(name))];
  }
  [[nodiscard]] const std::vector<ServoParameters>& servos() const { return robot.made_of().servos; }
  void set_state(const std::vector<double>& q0, std::vector<double> v0 = {}) {
    v0.resize(static_cast<std::size_t>(model.nv), 0.0);
    robot.set_state(q0, v0);
  }
  void run(double seconds) {
    const auto steps = from_seconds(seconds) / world.step;
    for (std::int64_t i = 0; i < steps; ++i) engine->step();
    ASSERT_FALSE(engine->diverged());
  }
  void hold_all() {
    for (const std::string& name : model.driven_joint_names())
      robot.set_drive(joint(name), DriveMode::position);
  }

  // -- objects
  void spawn(const WorldObject& object) { engine->spawn(make_instance(object, meshes, diagnostics)); }
  [[nodiscard]] bool is_there(const std::string& object) const { return engine->find(object).has_value(); }
  // Throws std::bad_optional_access if there is none.
  [[nodiscard]] Instance object(const std::string& name) const { return engine->find(name).value(); }
  [[nodiscard]] Pose pose(const std::string& name) const { return object(name).base_pose(); }
  [[nodiscard]] std::vector<NamedPair> excluded_pairs() const {
    std::vector<NamedPair> out;
    const CompiledWorld& compiled = engine->world();
    for (const ExcludedPair& pair : compiled.excluded_pairs())
      out.push_back({compiled.name_of(pair.a), compiled.name_of(pair.b), pair.reason, pair.depth});
    return out;
  }

  Diagnostics diagnostics;
  CollisionMeshes meshes;
  World world;
  std::shared_ptr<const Model> shared;
  const Model& model;
  std::unique_ptr<Engine> engine;
  Instance robot;
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

// A robot that does not move, where only the world matters.
inline RobotDescription make_post() {
  RobotDescription robot;
  robot.name = "post";
  robot.links = {make_frame("post")};
  return robot;
}

}  // namespace doppel::test
