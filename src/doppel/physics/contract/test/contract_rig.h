#pragma once
// Worlds for the contract suite, built in the same way for every engine.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "analytic_engine.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel::test {

inline constexpr double kGravity = 9.81;  // m/s^2, of WorldSettings

inline std::vector<std::string> engines_under_test() {
  static const bool registered = [] {
    register_engine(analytic_engine());
    return true;
  }();
  static_cast<void>(registered);
  std::vector<std::string> out;
  for (const KnownEngine& engine : known_engines()) {
    if (engine.available) out.push_back(engine.name);
  }
  return out;
}

// A test that runs for every engine of this build.
class Contract : public testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] const EngineCapabilities& can() const { return engine_module(GetParam()).capabilities; }
  [[nodiscard]] const EngineTolerances& within() const { return can().tolerances; }

  static WorldSettings settings(double step = 1e-3) {
    WorldSettings out;
    out.ground = false;
    out.step = from_seconds(step);
    return out;
  }
  ModelInstance robot(const RobotDescription& description, InstanceOptions options = {},
                      BaseKind base = BaseKind::fixed) {
    auto shared = std::make_shared<const RobotDescription>(description);
    auto model = std::make_shared<const Model>(compile_model(*shared, base, heard_));
    return make_instance(shared, model, options, meshes_, heard_);
  }
  ModelInstance object(const std::string& name, const Geometry& shape, const Pose& X_WO, double mass,
                       double friction = 0.8) {
    WorldObject out;
    out.name = name;
    out.shape = shape;
    out.X_WO = X_WO;
    out.mass = mass;
    out.friction = friction;
    return make_instance(out, meshes_, heard_);
  }
  std::unique_ptr<Engine> make(const WorldSettings& settings, std::vector<ModelInstance> instances) {
    return compile_world(GetParam(), settings, std::move(instances), heard_)->make_engine();
  }
  static void run(Engine& engine, double seconds) {
    const auto steps = from_seconds(seconds) / engine.world().settings().step;
    for (std::int64_t i = 0; i < steps; ++i) engine.step();
    ASSERT_FALSE(engine.diverged());
  }
  static Pose at(double x, double y, double z) {
    Pose out = Pose::Identity();
    out.translation() << x, y, z;
    return out;
  }
  static std::vector<double> copy(std::span<const double> of) { return {of.begin(), of.end()}; }
  static Eigen::VectorXd vector(std::span<const double> of) {
    return Eigen::Map<const Eigen::VectorXd>(of.data(), static_cast<Eigen::Index>(of.size()));
  }
  static void set(Instance of, std::vector<double> q, std::vector<double> v = {}) {
    v.resize(static_cast<std::size_t>(of.model().nv), 0.0);
    of.set_state(q, v);
  }
  static void hold_all(Instance of) {
    for (const std::string& name : of.model().driven_joint_names())
      of.set_drive(of.model().find_joint(name), DriveMode::position);
  }

  Diagnostics heard_;
  CollisionMeshes meshes_;
};

inline std::string engine_name(const testing::TestParamInfo<std::string>& info) {
  return info.param;
}

#define DOPPEL_FOR_EVERY_ENGINE(suite) \
  INSTANTIATE_TEST_SUITE_P(Engines, suite, testing::ValuesIn(engines_under_test()), engine_name)

}  // namespace doppel::test
