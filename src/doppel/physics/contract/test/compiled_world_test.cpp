// One compiled world and its states: what is shared, what is not, and several instances in one world.

#include <gmock/gmock.h>

#include <stdexcept>
#include <thread>

#include "doppel/physics/contract/test/allocation_counter.h"
#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using test::make_object;
using test::Rig;
using ::testing::HasSubstr;

std::vector<double> state_of(Engine& engine) {
  std::vector<double> out;
  for (int i = 0; i < static_cast<int>(engine.world().instances().size()); ++i) {
    const Instance instance = engine.instance(i);
    out.insert(out.end(), instance.q().begin(), instance.q().end());
    out.insert(out.end(), instance.v().begin(), instance.v().end());
    out.insert(out.end(), instance.drive_effort().begin(), instance.drive_effort().end());
  }
  return out;
}

World with_ball_and_wall() {
  World world;
  world.objects = {make_object("ball", Sphere{0.05}, {0.3, 0, 0.05}, 0.2),
                   make_object("wall", Box{{0.1, 1, 1}}, {2, 0, 0.5}, 0)};
  return world;
}

// A driven arm over the ground with a wall and a ball on the ground; friction in the joints.
struct BusyRig : Rig {
  BusyRig() : Rig(test::make_double_pendulum(1.0, 0.5, 1.0, 0.5), with_ball_and_wall()) {
    hold_all();
    robot.set_target(0, 0.4);
    object("ball").set_base_velocity({{0.5, 0, 0}, {0, 10, 0}});
    run(0.3);
  }
};

void step(Engine& engine, int count) {
  for (int i = 0; i < count; ++i) engine.step();
}

TEST(CompiledWorld, CloneContinuesBitIdentically) {
  BusyRig rig;
  const std::unique_ptr<Engine> clone = rig.engine->clone();
  EXPECT_EQ(clone->compiled(), rig.engine->compiled());
  EXPECT_EQ(state_of(*clone), state_of(*rig.engine));
  step(*rig.engine, 500);
  EXPECT_NE(state_of(*clone), state_of(*rig.engine));
  step(*clone, 500);
  EXPECT_EQ(state_of(*clone), state_of(*rig.engine));
  EXPECT_EQ(clone->time(), rig.engine->time());
}

TEST(CompiledWorld, CopiedStateContinuesBitIdenticallyWithoutAllocation) {
  BusyRig rig;
  const std::unique_ptr<Engine> other = rig.engine->compiled()->make_engine();
  step(*other, 77);
  const std::uint64_t before = test::heap_allocations();
  other->copy_state(*rig.engine);
  EXPECT_EQ(test::heap_allocations(), before);
  step(*rig.engine, 500);
  step(*other, 500);
  EXPECT_EQ(state_of(*other), state_of(*rig.engine));
}

TEST(CompiledWorld, StateOfOtherCompilationIsRefused) {
  BusyRig a, b;
  EXPECT_THROW(a.engine->copy_state(*b.engine), std::invalid_argument);
}

TEST(CompiledWorld, ResetEqualsFreshState) {
  BusyRig rig;
  const std::unique_ptr<Engine> fresh = rig.engine->compiled()->make_engine();
  rig.engine->reset();
  EXPECT_EQ(state_of(*fresh), state_of(*rig.engine));
  step(*fresh, 300);
  step(*rig.engine, 300);
  EXPECT_EQ(state_of(*fresh), state_of(*rig.engine));
}

TEST(CompiledWorld, DrivesAndPosesOfFixedObjectsAreState) {
  BusyRig rig;
  const std::unique_ptr<Engine> other = rig.engine->compiled()->make_engine();
  EXPECT_EQ(other->instance(0).drive(0), DriveMode::passive);
  rig.object("wall").place(make_pose({-2, 0, 0.5}, {0, 0, 0}));
  EXPECT_NEAR(other->find("wall")->base_pose().translation().x(), 2.0, 1e-12);
  // A driven joint has armature only in the compiled model's copy.
  step(*other, 200);
  const std::unique_ptr<Engine> untouched = rig.engine->compiled()->make_engine();
  step(*untouched, 200);
  EXPECT_EQ(state_of(*other), state_of(*untouched));
}

TEST(CompiledWorld, ThreadsSharingCompilationAreBitIdentical) {
  BusyRig rig;
  const std::shared_ptr<const CompiledWorld> compiled = rig.engine->compiled();
  const auto run_alone = [&compiled](int lane) {
    const std::unique_ptr<Engine> engine = compiled->make_engine();
    engine->instance(0).set_drive(0, DriveMode::position);
    engine->instance(0).set_target(0, 0.1 * lane);
    step(*engine, 400);
    return state_of(*engine);
  };
  std::vector<std::vector<double>> alone, together(4);
  for (int lane = 0; lane < 4; ++lane) alone.push_back(run_alone(lane));
  {
    std::vector<std::jthread> threads;
    for (int lane = 0; lane < 4; ++lane)
      threads.emplace_back([&, lane] { together[static_cast<std::size_t>(lane)] = run_alone(lane); });
  }
  EXPECT_EQ(alone, together);
}

// Two pendulums that swing towards each other.
struct TwoRobots : Rig {
  TwoRobots() : Rig(pendulum_with_ball()) {
    InstanceOptions options;
    options.name = "second";
    options.X_WR.translation() = Eigen::Vector3d(0.5, 0, 0);
    second = make_instance(robot.made_of().description, shared, options, meshes, diagnostics);
  }
  static RobotDescription pendulum_with_ball() {
    RobotDescription out = test::make_pendulum(1.0, 0.5);
    Collision ball;
    ball.geometry = Sphere{0.1};
    ball.origin.xyz = {0, 0, -0.5};
    out.links[1].collisions.push_back(ball);
    return out;
  }
  ModelInstance second;
};

TEST(ModelInstances, TwoRobotsOfOneModelTouchEachOther) {
  TwoRobots rig;
  rig.engine->spawn(rig.second);
  Instance left = rig.engine->instance(0), right = rig.engine->find("second").value();
  const std::vector<double> rest{0.0};
  left.set_state(std::vector<double>{-1.0}, rest);  // the swing's axis is +y: a negative angle is towards +x
  right.set_state(std::vector<double>{1.0}, rest);
  bool touched = false;
  std::vector<Contact> contacts;
  for (int i = 0; i < 1000; ++i) {
    rig.engine->step();
    rig.engine->contacts(contacts);
    for (const Contact& contact : contacts)
      touched = touched || (std::min(contact.a, contact.b) == BodyId{0, 1} &&
                            std::max(contact.a, contact.b) == BodyId{1, 1});
  }
  EXPECT_TRUE(touched);
  EXPECT_LT(left.link_pose(1).translation().x() + 0.19, right.link_pose(1).translation().x() + 0.5);
}

TEST(ModelInstances, AddedOrRemovedRobotKeepsOtherStates) {
  TwoRobots rig, alone;
  for (Rig* const each : {static_cast<Rig*>(&rig), static_cast<Rig*>(&alone)}) {
    each->set_state({0.7}, {0.2});
    each->robot.set_drive(0, DriveMode::velocity);
    each->robot.set_target(0, 0.3);
    each->robot.apply_joint_effort(0, 0.1);
    each->run(0.2);
  }
  rig.second.X_WR.translation().x() = 50;
  rig.engine->spawn(rig.second);
  EXPECT_EQ(rig.q("swing"), alone.q("swing"));
  rig.run(0.3);
  alone.run(0.3);
  EXPECT_EQ(rig.q("swing"), alone.q("swing"));
  EXPECT_TRUE(rig.engine->remove("second"));
  EXPECT_FALSE(rig.engine->remove("second"));
  rig.run(0.3);
  alone.run(0.3);
  EXPECT_EQ(rig.q("swing"), alone.q("swing"));
  EXPECT_EQ(rig.effort("swing"), alone.effort("swing"));
  EXPECT_EQ(rig.engine->time(), alone.engine->time());
}

TEST(ModelInstances, DuplicateNameIsRefused) {
  TwoRobots rig;
  rig.second.name = rig.robot.name();
  const std::vector<double> before = state_of(*rig.engine);
  EXPECT_THROW(rig.engine->spawn(rig.second), InputError);
  EXPECT_EQ(state_of(*rig.engine), before);
}

TEST(ModelInstances, BasePosesCanBeSet) {
  Rig rig(test::make_pendulum(1.0, 0.5), with_ball_and_wall());
  rig.robot.set_root_pose(make_pose({1, 2, 3}, {0, 0, 0.5}));
  EXPECT_NEAR((rig.robot.link_pose(0).translation() - Eigen::Vector3d(1, 2, 3)).norm(), 0, 1e-12);
  EXPECT_NEAR(rig.robot.link_pose(1).translation().z(), 5.0, 1e-12);
  const Pose X = make_pose({0.2, 0.3, 2}, {0.1, 0.2, 0.3});
  rig.object("ball").place(X);
  EXPECT_TRUE(rig.pose("ball").isApprox(X, 1e-12));
  rig.engine->reset();
  EXPECT_NEAR(rig.robot.link_pose(0).translation().norm(), 0, 1e-12);
}

TEST(ModelInstances, IndicesOutOfRangeAreRefused) {
  Rig rig(test::make_pendulum(1.0, 0.5));
  EXPECT_THROW(static_cast<void>(rig.engine->instance(1)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(rig.engine->instance(-1)), std::out_of_range);
  EXPECT_THROW(rig.robot.set_target(1, 0.0), std::out_of_range);
  EXPECT_THROW(rig.robot.set_drive(-1, DriveMode::position), std::out_of_range);
  EXPECT_THROW(rig.robot.apply_joint_effort(7, 1.0), std::out_of_range);
  EXPECT_THROW(static_cast<void>(rig.robot.link_pose(2)), std::out_of_range);
  EXPECT_THROW(rig.robot.set_state(std::vector<double>{}, std::vector<double>{0.0}), std::out_of_range);
}

TEST(EngineModules, UnknownEngineIsRefusedWithNearest) {
  try {
    engine_module("mujoko");
    FAIL() << "expected an InputError: the engine does not exist";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("there is no engine 'mujoko'; did you mean 'mujoco'?"));
  }
  const auto known = known_engines();
  EXPECT_TRUE(std::ranges::any_of(known, [](const auto& k) { return k.name == "mujoco" && k.available; }));
}

TEST(EngineModules, MissingCapabilityIsReportedByName) {
  EngineCapabilities poor;
  poor.name = "poor";
  poor.integrators = {Integrator::euler};
  Rig rig(TwoRobots::pendulum_with_ball());
  std::vector<ModelInstance> instances = rig.engine->world().instances();
  Model with_friction = *instances[0].model;
  with_friction.joints[0].friction = 0.1;
  instances[0].model = std::make_shared<const Model>(with_friction);
  Diagnostics said;
  report_missing_capabilities(poor, WorldSettings{}, instances, said);
  std::string all;
  for (const Diagnostic& d : said.all()) all += d.str() + "\n";
  EXPECT_THAT(all, HasSubstr("the engine poor has no contacts in"));
  EXPECT_THAT(all, HasSubstr("joint friction of 'swing'"));
  WorldSettings settings;
  settings.integrator = Integrator::rk4;
  EXPECT_THROW(report_missing_capabilities(poor, settings, instances, said), InputError);
}

}  // namespace
}  // namespace doppel
