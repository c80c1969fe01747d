// The contract for every engine: state that is written, read, copied, and preserved while other instances are
// added and removed.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <stdexcept>
#include <thread>

#include "allocation_counter.h"
#include "contract_rig.h"

namespace doppel::test {
namespace {

class StateContract : public Contract {
 protected:
  // An arm with limits, damping and a mimic joint, held; next to it a box on the ground if the engine has
  // contacts.
  std::vector<ModelInstance> scene() {
    std::mt19937 random(2);
    RobotDescription chain = make_random_chain(six_hinges(), random);
    chain.name = "arm";
    for (Joint& joint : chain.joints) {
      limit(joint, -2, 2, 3, 2);
      joint.type = JointType::revolute;
      joint.dynamics = JointDynamics{0.01, can().friction ? 0.02 : 0.0, {}};
    }
    chain.joints[5].mimic = Mimic{"joint4", 0.5, 0.1, {}};
    std::vector<ModelInstance> out{robot(chain)};
    if (can().contacts) out.push_back(object("box", Box{{0.1, 0.1, 0.1}}, at(0.6, 0, 0.06), 0.5));
    return out;
  }
  std::unique_ptr<Engine> make_scene() {
    WorldSettings in = settings();
    in.ground = can().contacts;
    return make(in, scene());
  }
  // Moves the targets by fixed random numbers.
  static void drive(Engine& engine, std::mt19937& random, int steps) {
    std::uniform_real_distribution<double> unit(-1, 1);
    Instance arm = engine.instance(0);
    for (int i = 0; i < steps; ++i) {
      if (i % 20 == 0) {
        for (int joint = 0; joint < 5; ++joint) arm.set_target(joint, unit(random));
      }
      engine.step();
    }
  }
  static std::vector<double> bits(Engine& engine) {
    std::vector<double> out;
    for (int i = 0; i < static_cast<int>(engine.world().instances().size()); ++i) {
      const Instance of = engine.instance(i);
      for (const auto part : {of.q(), of.v(), of.drive_effort()})
        out.insert(out.end(), part.begin(), part.end());
    }
    return out;
  }
  static bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
  }
};
DOPPEL_FOR_EVERY_ENGINE(StateContract);

TEST_P(StateContract, SameCommandsAreBitIdentical) {
  std::vector<double> first;
  for (int run = 0; run < 2; ++run) {
    const auto engine = make_scene();
    hold_all(engine->instance(0));
    std::mt19937 random(1);
    drive(*engine, random, 500);
    if (run == 0) first = bits(*engine);
    EXPECT_TRUE(same_bits(bits(*engine), first));
  }
}

TEST_P(StateContract, ResetStateRunsAsFresh) {
  const auto engine = make_scene(), fresh = make_scene();
  hold_all(engine->instance(0));
  std::mt19937 random(1);
  drive(*engine, random, 300);
  engine->reset();
  EXPECT_EQ(engine->time(), time_from_nanoseconds(0));
  for (Engine* of : {engine.get(), fresh.get()}) {
    hold_all(of->instance(0));
    std::mt19937 same(4);
    drive(*of, same, 300);
  }
  EXPECT_TRUE(same_bits(bits(*engine), bits(*fresh)));
}

TEST_P(StateContract, WrittenStateReadsBack) {
  const auto engine = make_scene();
  Instance arm = engine->instance(0);
  std::vector<double> q{0.1, -0.2, 0.3, -0.4, 0.5, 9.0}, v{1, 2, 3, 4, 5, 9.0};
  arm.set_state(q, v);
  q[5] = 0.5 * 0.5 + 0.1;  // the mimic follows
  v[5] = 2.5;
  EXPECT_EQ(copy(arm.q()), q);
  EXPECT_EQ(copy(arm.v()), v);
}

TEST_P(StateContract, CloneContinuesBitIdentically) {
  const auto engine = make_scene();
  hold_all(engine->instance(0));
  std::mt19937 random(1);
  drive(*engine, random, 217);
  const auto clone = engine->clone();
  EXPECT_TRUE(same_bits(bits(*engine), bits(*clone)));
  EXPECT_EQ(engine->time(), clone->time());
  for (Engine* of : {engine.get(), clone.get()}) {
    std::mt19937 same(9);
    drive(*of, same, 300);
  }
  EXPECT_TRUE(same_bits(bits(*engine), bits(*clone)));
}

TEST_P(StateContract, CopiedStateContinuesBitIdentically) {
  const auto engine = make_scene();
  const auto other = engine->compiled()->make_engine();
  hold_all(engine->instance(0));
  std::mt19937 random(1);
  drive(*other, random, 30);
  drive(*engine, random, 217);
  other->copy_state(*engine);
  for (Engine* of : {engine.get(), other.get()}) {
    std::mt19937 same(9);
    drive(*of, same, 300);
  }
  EXPECT_TRUE(same_bits(bits(*engine), bits(*other)));
}

// Energies, ray hits and contacts.
std::vector<double> looked_at(const Engine& engine) {
  std::vector<double> out{engine.kinetic_energy(), engine.potential_energy()};
  if (engine.world().capabilities().rays) {
    const RayHit hit = engine.cast_ray({0.6, 0, 3}, {0, 0, -1});
    out.insert(out.end(), {hit.distance, static_cast<double>(hit.body.instance)});
  }
  std::vector<Contact> contacts;
  if (engine.world().capabilities().contacts) engine.contacts(contacts);
  for (const Contact& contact : contacts) {
    for (const Eigen::Vector3d& of : {contact.p_W, contact.normal_W, contact.force_W})
      out.insert(out.end(), of.begin(), of.end());
    out.push_back(contact.depth);
  }
  return out;
}

TEST_P(StateContract, CopyReadsAsOriginal) {
  const auto resting = make_scene(), flying = resting->clone();
  run(*resting, 0.2);
  if (can().contacts) flying->find("box")->place(at(0.6, 0, 2));
  flying->step();
  EXPECT_NE(looked_at(*resting), looked_at(*flying));
  const auto clone = resting->clone();
  EXPECT_EQ(looked_at(*clone), looked_at(*resting));
  clone->copy_state(*flying);
  EXPECT_EQ(looked_at(*clone), looked_at(*flying));
  clone->copy_state(*resting);
  EXPECT_EQ(looked_at(*clone), looked_at(*resting));
  for (Engine* of : {clone.get(), resting.get()}) run(*of, 0.1);
  EXPECT_TRUE(same_bits(bits(*clone), bits(*resting)));
}

TEST_P(StateContract, InterleavedStatesAreIndependent) {
  const auto engine = make_scene();
  hold_all(engine->instance(0));
  std::vector<std::unique_ptr<Engine>> apart, in_turn;
  for (int i = 0; i < 3; ++i) {
    apart.push_back(engine->clone());
    in_turn.push_back(engine->clone());
    std::mt19937 own(static_cast<unsigned>(20 + i));
    drive(*apart.back(), own, 200);
  }
  std::vector<std::mt19937> own{std::mt19937(20), std::mt19937(21), std::mt19937(22)};
  for (int round = 0; round < 10; ++round) {
    for (std::size_t i = 0; i < in_turn.size(); ++i) drive(*in_turn[i], own[i], 20);
  }
  for (std::size_t i = 0; i < apart.size(); ++i) {
    EXPECT_TRUE(same_bits(bits(*in_turn[i]), bits(*apart[i]))) << i;
    EXPECT_EQ(looked_at(*in_turn[i]), looked_at(*apart[i])) << i;
  }
  EXPECT_FALSE(same_bits(bits(*apart[0]), bits(*apart[1]))) << "expected different motions";
}

TEST_P(StateContract, DivergedStateIsCopied) {
  const auto engine = make(settings(), {robot(make_pendulum(1.0, 0.5))});
  set(engine->instance(0), {0.3});
  run(*engine, 0.01);
  engine->instance(0).apply_joint_effort(0, 1e200);
  engine->step();
  ASSERT_TRUE(engine->diverged());
  const auto clone = engine->clone();
  EXPECT_TRUE(clone->diverged());
  const std::vector<double> before = bits(*clone);
  clone->step();
  EXPECT_TRUE(same_bits(bits(*clone), before));
  EXPECT_EQ(clone->time(), engine->time());
  const auto recovered = engine->clone();
  recovered->reset();
  EXPECT_FALSE(recovered->diverged());
  run(*recovered, 0.1);
  const auto never = engine->compiled()->make_engine();
  run(*never, 0.1);
  EXPECT_TRUE(same_bits(bits(*recovered), bits(*never)));
}

TEST_P(StateContract, StatesOnThreadsAreBitIdentical) {
  const auto engine = make_scene();
  hold_all(engine->instance(0));
  std::vector<std::unique_ptr<Engine>> states;
  for (int i = 0; i < 4; ++i) states.push_back(engine->clone());
  std::vector<std::thread> threads;
  for (const auto& state : states) {
    threads.emplace_back([&state] {
      std::mt19937 same(9);
      drive(*state, same, 200);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& state : states) EXPECT_TRUE(same_bits(bits(*state), bits(*states.front())));
}

TEST_P(StateContract, StateOfAnotherCompilationIsRefused) {
  const auto engine = make_scene(), other = make_scene();
  EXPECT_THROW(engine->copy_state(*other), std::invalid_argument);
}

TEST_P(StateContract, ReadingChangesNothing) {
  const auto engine = make_scene(), looked_at = make_scene();
  for (Engine* of : {engine.get(), looked_at.get()}) hold_all(of->instance(0));
  std::vector<Contact> contacts;
  for (int i = 0; i < 200; ++i) {
    engine->step();
    looked_at->step();
    looked_at->contacts(contacts);
    static_cast<void>(looked_at->cast_ray({0, 0, 3}, {0, 0, -1}));
    static_cast<void>(looked_at->kinetic_energy());
  }
  EXPECT_TRUE(same_bits(bits(*engine), bits(*looked_at)));
}

TEST_P(StateContract, SpawnedInstanceKeepsOtherStates) {
  const auto engine = make_scene();
  hold_all(engine->instance(0));
  std::mt19937 random(1);
  drive(*engine, random, 150);
  const std::vector<double> before = bits(*engine);
  const Time time = engine->time();
  InstanceOptions options;
  options.name = "second";
  options.X_WR.translation() << 5, 0, 0;
  engine->spawn(robot(make_pendulum(1.0, 0.5), options));
  const std::vector<double> after = bits(*engine);
  ASSERT_GT(after.size(), before.size());
  EXPECT_TRUE(same_bits({after.begin(), after.begin() + static_cast<std::ptrdiff_t>(before.size())}, before));
  EXPECT_EQ(engine->time(), time);
  EXPECT_EQ(engine->instance(0).drive(0), DriveMode::position);
  ASSERT_TRUE(engine->find("second"));
  set(*engine->find("second"), {0.7});
  run(*engine, 0.1);
  EXPECT_LT(engine->find("second")->q()[0], 0.7);
}

TEST_P(StateContract, RemovedInstanceKeepsOtherStates) {
  InstanceOptions options;
  options.name = "second";
  options.X_WR.translation() << 5, 0, 0;
  std::vector<ModelInstance> instances = scene();
  instances.insert(instances.begin(), robot(make_pendulum(1.0, 0.5), options));
  const auto engine = make(settings(), instances);
  Instance arm = *engine->find("arm");
  hold_all(arm);
  run(*engine, 0.2);
  const std::vector<double> q = copy(arm.q()), v = copy(arm.v());
  EXPECT_FALSE(engine->remove("nobody"));
  EXPECT_TRUE(engine->remove("second"));
  arm = *engine->find("arm");
  EXPECT_EQ(copy(arm.q()), q);
  EXPECT_EQ(copy(arm.v()), v);
  EXPECT_EQ(arm.drive(0), DriveMode::position);
  run(*engine, 0.1);
}

TEST_P(StateContract, DuplicateNameIsRefusedWithoutChange) {
  const auto engine = make_scene();
  const std::vector<double> before = bits(*engine);
  InstanceOptions options;
  options.name = "arm";
  EXPECT_THROW(engine->spawn(robot(make_pendulum(1, 1), options)), InputError);
  EXPECT_TRUE(same_bits(bits(*engine), before));
}

TEST_P(StateContract, TwoRobotsMoveIndependently) {
  InstanceOptions left, right;
  left.name = "left";
  right.name = "right";
  right.X_WR = make_pose({0.8, 0, 0}, {0, 0, 3.14});
  const auto engine =
      make(settings(), {robot(make_pendulum(1, 0.5), left), robot(make_pendulum(1, 0.5), right)});
  const auto alone = make(settings(), {robot(make_pendulum(1, 0.5), left)});
  set(engine->instance(0), {0.4});
  set(engine->instance(1), {-0.9});
  set(alone->instance(0), {0.4});
  run(*engine, 0.5);
  run(*alone, 0.5);
  EXPECT_NEAR(engine->instance(0).q()[0], alone->instance(0).q()[0], 1e-12);
  EXPECT_NE(engine->instance(1).q()[0], engine->instance(0).q()[0]);
  EXPECT_NEAR(engine->instance(1).link_pose(0).translation().x(), 0.8, 1e-15);
}

TEST_P(StateContract, RootCanBeMovedWhileWorldRuns) {
  const auto engine = make(settings(), {robot(make_pendulum(1, 0.5))});
  Instance of = engine->instance(0);
  run(*engine, 0.1);
  of.set_root_pose(at(1, 2, 3));
  EXPECT_NEAR((of.link_pose(0).translation() - Eigen::Vector3d(1, 2, 3)).norm(), 0.0, 1e-15);
  run(*engine, 0.1);
  EXPECT_NEAR((of.link_pose(0).translation() - Eigen::Vector3d(1, 2, 3)).norm(), 0.0, 1e-15);
  engine->reset();
  EXPECT_NEAR(of.link_pose(0).translation().norm(), 0.0, 1e-15);
}

TEST_P(StateContract, IndexOutOfRangeIsRefused) {
  const auto engine = make_scene();
  EXPECT_THROW(static_cast<void>(engine->instance(99)), std::out_of_range);
  EXPECT_THROW(engine->instance(0).set_drive(99, DriveMode::position), std::out_of_range);
  EXPECT_THROW(engine->instance(0).set_drive(5, DriveMode::position), std::out_of_range);  // a mimic joint
  EXPECT_THROW(static_cast<void>(engine->instance(0).link_pose(-1)), std::out_of_range);
}

TEST_P(StateContract, StepDoesNotAllocate) {
  if (GetParam() == "analytic") GTEST_SKIP() << "the analytic engine is for tests only";
  const auto engine = make_scene();
  hold_all(engine->instance(0));
  std::mt19937 random(1);
  drive(*engine, random, 200);
  const std::uint64_t before = heap_allocations();
  drive(*engine, random, 200);
  EXPECT_EQ(heap_allocations(), before);
}

// -- attachments

class AttachmentContract : public Contract {
 protected:
  // A pendulum of 1 kg at 0.5 m, and a ball of 0.5 kg beside its end.
  std::unique_ptr<Engine> make_pendulum_and_ball() {
    return make(settings(),
                {robot(make_pendulum(1.0, 0.5)), object("ball", Sphere{0.05}, at(0.1, 0, 1.5), 0.5)});
  }
  static BodyId end_of_pendulum(const Engine& engine) {
    return {0, static_cast<int>(engine.world().instances()[0].model->links.size()) - 1};
  }
  static BodyId ball(const Engine& engine) { return {1, engine.world().instances()[1].base_link()}; }
  static Pose between(const Engine& engine) {
    const BodyId end = end_of_pendulum(engine);
    return engine.instance(0).link_pose(end.link).inverse() * engine.instance(1).base_pose();
  }
};
DOPPEL_FOR_EVERY_ENGINE(AttachmentContract);

TEST_P(AttachmentContract, EngineWithoutAttachmentsRefuses) {
  const auto engine = make_pendulum_and_ball();
  const Status status = engine->attach(end_of_pendulum(*engine), ball(*engine));
  EXPECT_EQ(status.ok(), can().attachments) << status.why();
  EXPECT_EQ(engine->attachments().size(), can().attachments ? 1U : 0U);
}

TEST_P(AttachmentContract, AttachedBodySwingsAlongAndFallsWhenDetached) {
  if (!can().attachments) GTEST_SKIP();
  const auto engine = make_pendulum_and_ball();
  const BodyId end = end_of_pendulum(*engine);
  ASSERT_TRUE(engine->attach(end, ball(*engine)));
  EXPECT_FALSE(engine->attach(ball(*engine), end)) << "expected a second attachment to be refused";
  const Pose before = between(*engine);
  set(engine->instance(0), {0.01});
  EXPECT_TRUE(between(*engine).isApprox(before, 1e-9)) << "expected the ball to be placed along";
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    engine->step();
    worst = std::max(worst, (between(*engine).translation() - before.translation()).norm());
  }
  EXPECT_LT(worst, 1e-6);
  EXPECT_TRUE(engine->detach(ball(*engine), end));
  EXPECT_FALSE(engine->detach(ball(*engine), end));
  const double speed = engine->instance(1).base_velocity().linear_W.z();
  run(*engine, 0.1);
  EXPECT_NEAR(engine->instance(1).base_velocity().linear_W.z(), speed - 0.1 * kGravity, 1e-6);
}

TEST_P(AttachmentContract, BodyIsPlacedAlongInEitherOrder) {
  if (!can().attachments) GTEST_SKIP();
  const auto engine = make_pendulum_and_ball();
  engine->spawn(object("second", Sphere{0.05}, at(0.3, 0, 1.5), 0.5));
  const BodyId second{2, engine->world().instances()[2].base_link()};
  ASSERT_TRUE(engine->attach(ball(*engine), end_of_pendulum(*engine)));
  ASSERT_TRUE(engine->attach(second, ball(*engine)));
  const Pose before = between(*engine);
  const auto between_balls = [&] {
    return engine->instance(1).base_pose().inverse() * engine->instance(2).base_pose();
  };
  const Pose far = between_balls();
  set(engine->instance(0), {0.5});
  EXPECT_TRUE(between(*engine).isApprox(before, 1e-9));
  EXPECT_TRUE(between_balls().isApprox(far, 1e-9));
}

// As a hand that holds a body by its palm and by a finger.
TEST_P(AttachmentContract, RingOfAttachmentsIsPlacedOnce) {
  if (!can().attachments) GTEST_SKIP();
  std::mt19937 random(2);
  const auto engine =
      make(settings(), {robot(make_random_chain(six_hinges(), random), {}, BaseKind::floating),
                        object("ball", Sphere{0.05}, at(3, 0, 1.5), 0.5)});
  Instance chain = engine->instance(0);
  const BodyId palm{0, 3}, finger{0, 7};
  ASSERT_TRUE(engine->attach(palm, ball(*engine)));
  ASSERT_TRUE(engine->attach(ball(*engine), finger));
  const Pose base = chain.base_pose();
  const auto in_palm = [&] { return chain.link_pose(palm.link).inverse() * engine->instance(1).base_pose(); };
  const Pose before = in_palm();
  std::vector<double> q = copy(chain.q());
  q[7] += 0.3;
  q.back() += 0.4;
  set(chain, q);
  EXPECT_TRUE(chain.base_pose().isApprox(base, 1e-9)) << "expected what was written to stay";
  EXPECT_TRUE(in_palm().isApprox(before, 1e-9));
}

TEST_P(AttachmentContract, LinksThatCannotMoveAreRefused) {
  if (!can().attachments) GTEST_SKIP();
  RobotDescription other = make_pendulum(1.0, 0.5);
  other.name = "other";
  std::mt19937 random(2);
  RobotDescription floating = make_random_chain(six_hinges(), random);
  floating.name = "floating";
  const auto engine = make(
      settings(), {robot(make_pendulum(1.0, 0.5)), robot(other), robot(floating, {}, BaseKind::floating)});
  EXPECT_THAT(engine->attach({0, 0}, {1, 0}).why(), testing::HasSubstr("are both fixed to the world"));
  EXPECT_FALSE(engine->attach({0, 0}, {2, 0})) << "expected the link above a floating base not to move";
  EXPECT_TRUE(engine->attach({0, 0}, {2, 1}));
  EXPECT_TRUE(engine->attach({1, 0}, end_of_pendulum(*engine)));
}

TEST_P(AttachmentContract, PeriodIsThatOfJoinedMasses) {
  if (!can().attachments) GTEST_SKIP();
  const auto engine =
      make(settings(), {robot(make_pendulum(1.0, 0.5)), object("ball", Sphere{0.05}, at(0, 0, 1.75), 0.5)});
  Instance pendulum = engine->instance(0);
  ASSERT_TRUE(engine->attach(end_of_pendulum(*engine), ball(*engine)));
  set(pendulum, {0.01});
  const auto inertia = [](const Engine& of, int i, double distance) {
    const MassProperties& body =
        *of.world().instances()[static_cast<std::size_t>(i)].model->links.back().inertia;
    return body.I(1, 1) + body.mass * distance * distance;
  };
  const double expected = 2 * std::numbers::pi *
                          std::sqrt((inertia(*engine, 0, 0.5) + inertia(*engine, 1, 0.25)) /
                                    ((1.0 * 0.5 + 0.5 * 0.25) * kGravity));
  int crossings = 0;
  double first = 0, last = 0;
  for (double before = pendulum.q()[0]; crossings < 5;) {
    engine->step();
    const double now = pendulum.q()[0];
    if (before > 0 && now <= 0) {
      last = to_seconds(engine->time()) - 1e-3 * now / (now - before);
      if (crossings++ == 0) first = last;
    }
    before = now;
    ASSERT_LT(to_seconds(engine->time()), 20.0);
  }
  EXPECT_NEAR((last - first) / 4 / expected, 1.0, 1e-4);
}

TEST_P(AttachmentContract, AttachmentIsPartOfState) {
  if (!can().attachments) GTEST_SKIP();
  const auto engine = make_pendulum_and_ball();
  ASSERT_TRUE(engine->attach(end_of_pendulum(*engine), ball(*engine)));
  set(engine->instance(0), {0.5});
  run(*engine, 0.1);
  const auto copy = engine->clone(), other = engine->world().make_engine();
  other->copy_state(*engine);
  engine->spawn(object("far", Sphere{0.05}, at(5, 0, 0), 0.5));
  for (Engine* each : {engine.get(), copy.get(), other.get()}) {
    ASSERT_EQ(each->attachments().size(), 1U);
    run(*each, 0.2);
  }
  EXPECT_EQ(copy->instance(0).q()[0], other->instance(0).q()[0]);
  EXPECT_NEAR(engine->instance(0).q()[0], copy->instance(0).q()[0], 1e-9);
  EXPECT_NEAR((between(*engine).translation() - between(*copy).translation()).norm(), 0, 1e-9);
  EXPECT_TRUE(engine->remove("ball"));
  EXPECT_TRUE(engine->attachments().empty());
  copy->reset();
  EXPECT_TRUE(copy->attachments().empty());
  run(*copy, 0.1);
  EXPECT_NEAR(copy->instance(1).base_velocity().linear_W.z(), -0.1 * kGravity, 1e-6);
}

TEST_P(AttachmentContract, AttachedBodiesDoNotTouchEachOther) {
  if (!can().attachments) GTEST_SKIP();
  const auto engine = make(settings(), {object("a", Box{{0.1, 0.1, 0.1}}, at(0, 0, 1), 1.0),
                                        object("b", Box{{0.1, 0.1, 0.1}}, at(0, 0, 1.09), 1.0)});
  const BodyId a{0, engine->world().instances()[0].base_link()},
      b{1, engine->world().instances()[1].base_link()};
  std::vector<Contact> contacts;
  engine->contacts(contacts);
  ASSERT_FALSE(contacts.empty());
  ASSERT_TRUE(engine->attach(a, b));
  engine->contacts(contacts);
  EXPECT_TRUE(contacts.empty());
  run(*engine, 0.2);
  EXPECT_NEAR(
      (engine->instance(1).base_pose().translation() - engine->instance(0).base_pose().translation()).z(),
      0.09, 1e-6);
}

}  // namespace
}  // namespace doppel::test
