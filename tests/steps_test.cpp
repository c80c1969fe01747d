// How steps are taken, on whole robots: the bundled ones, arms of ../shared/corpus if it is there, and those
// that a file names: DOPPEL_ARMS=FILE, each line a name, a description and its xacro arguments. Public arms
// are downloaded, not committed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <numeric>
#include <random>
#include <sstream>

#include "doppel/physics/contract/step_scheme.h"
#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/reference_motion.h"
#include "doppel/robot/kinematics/test/integrate.h"
#include "doppel/scenario/compile/compiled_scenario.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr int kPoses = 8;
constexpr Integrator kAll[] = {Integrator::euler, Integrator::midpoint, Integrator::rk4,
                               Integrator::implicit};

struct Arm {
  std::string name;
  Scenario scenario;
};

void PrintTo(const Arm& arm, std::ostream* out) {
  *out << arm.name;
}

Scenario scenario_of(const std::string& target) {
  Scenario scenario;
  scenario.robots = {{.target = target}};
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  return scenario;
}

std::vector<Arm> listed_arms() {
  std::vector<Arm> arms;
  const char* const list = std::getenv("DOPPEL_ARMS");
  std::ifstream in(list != nullptr ? list : "");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string name, target;
    if (!(words >> name >> target)) continue;
    Arm arm{name, scenario_of(target)};
    for (std::string word; words >> word;) {
      const std::size_t at = word.find(":=");
      arm.scenario.robots.front().arguments.emplace_back(word.substr(0, at), word.substr(at + 2));
    }
    arms.push_back(std::move(arm));
  }
  return arms;
}

std::vector<Arm> find_arms() {
  std::vector<Arm> arms = listed_arms();
  for (const char* bundled : {"omarm_one", "omarm_zero", "lab_arm"})
    arms.push_back({bundled, scenario_of(bundled)});
  const fs::path corpus = fs::path(DOPPEL_SOURCE_DIR) / ".." / "shared" / "corpus" / "expected";
  for (const char* id : {"ur-ur-ur5e", "interbotix-uxarm6", "interbotix-uxarm7", "interbotix-vx300s"}) {
    const fs::path file = corpus / (std::string(id) + ".urdf");
    if (fs::exists(file)) arms.push_back({id, scenario_of(file.string())});
  }
  return arms;
}

// A robot in empty space.
std::unique_ptr<Engine> alone(const RobotDescription& robot, std::shared_ptr<const Model> model,
                              const InstanceOptions& options, Integrator integrator, double step,
                              Diagnostics& diagnostics) {
  CollisionMeshes meshes;
  const WorldSettings settings = test::empty_space(step, integrator);
  return compile_world(kDefaultEngine, settings,
                       {make_instance(std::make_shared<const RobotDescription>(robot), std::move(model),
                                      options, meshes, diagnostics)},
                       diagnostics)
      ->make_engine();
}

// The robot of a machine in empty space, alone.
struct Bench {
  explicit Bench(const Arm& arm) : machine(arm.scenario, diagnostics) {}

  [[nodiscard]] const CompiledRobot& robot() const { return *machine.robots.front(); }
  [[nodiscard]] const Model& model() const { return robot().model(); }
  [[nodiscard]] Eigen::Vector3d gravity() const { return {0, 0, -9.81}; }
  std::unique_ptr<Engine> engine(Integrator integrator, double step) {
    InstanceOptions options;
    options.servos = robot().servos();
    options.self_collision = false;
    return alone(robot().description(), robot().shared_model(), options, integrator, step, diagnostics);
  }
  // Within the limits, with mimic joints following, and within the drives' efforts.
  Eigen::VectorXd pose(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    Data data(model());
    StaticSag sag;
    for (int tries = 0; tries < 1000; ++tries) {
      Eigen::VectorXd q = model().neutral();
      for (const ModelJoint& joint : model().joints) {
        if (!joint.scalar()) continue;
        const double lower = std::isfinite(joint.lower) ? joint.lower : -3;
        const double upper = std::isfinite(joint.upper) ? joint.upper : 3;
        q[joint.q] = lower + (0.05 + 0.9 * unit(random)) * (upper - lower);
      }
      model().apply_mimics(q);
      static_sag(model(), data, robot().servos(), q, gravity(), sag);
      if (std::all_of(sag.sags.begin(), sag.sags.end(), [](const Sag& s) { return s.margin > 0; })) return q;
    }
    ADD_FAILURE() << "expected a pose that the drives can hold";
    return model().neutral();
  }

  Diagnostics diagnostics;
  CompiledScenario machine;
};

void start(Engine& engine, const Model& model, const Eigen::VectorXd& q) {
  Instance robot = engine.instance(0);
  const std::vector<double> rest(static_cast<std::size_t>(model.nv), 0.0);
  robot.set_state({q.data(), static_cast<std::size_t>(q.size())}, rest);
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].scalar() && !model.joints[j].mimics())
      robot.set_drive(static_cast<int>(j), DriveMode::position);
  }
}

void run(Engine& engine, double seconds) {
  const Time end = engine.time() + from_seconds(seconds);
  while (engine.time() < end && !engine.diverged()) engine.step();
  ASSERT_FALSE(engine.diverged());
}

double fastest(const Engine& engine) {
  double out = 0;
  for (const double v : engine.instance(0).v()) out = std::max(out, std::abs(v));
  return out;
}

class IntegrationStepsTest : public ::testing::TestWithParam<Arm> {};

TEST_P(IntegrationStepsTest, RandomPosesAreHeldUnderEveryIntegrator) {
  Bench bench(GetParam());
  for (const Integrator integrator : kAll) {
    const unsigned seed = 11;
    std::mt19937 random(seed);
    const auto engine = bench.engine(integrator, 1e-3);
    for (int i = 0; i < kPoses; ++i) {
      SCOPED_TRACE(std::string(name_of(integrator)) + ", seed " + std::to_string(seed) + ", pose " +
                   std::to_string(i));
      start(*engine, bench.model(), bench.pose(random));
      run(*engine, 0.9);
      const std::vector<double> before(engine->instance(0).q().begin(), engine->instance(0).q().end());
      run(*engine, 0.1);
      for (std::size_t k = 0; k < before.size(); ++k)
        EXPECT_NEAR(engine->instance(0).q()[k], before[k], 1e-4);
      // and it is where the sag, including friction, predicts
      Data data(bench.model());
      StaticSag sag;
      static_sag(bench.model(), data, bench.robot().servos(),
                 Eigen::Map<const Eigen::VectorXd>(engine->instance(0).q().data(), bench.model().nq),
                 bench.gravity(), sag);
      for (const Sag& s : sag.sags) {
        const auto joint = static_cast<std::size_t>(s.joint);
        const double q = engine->instance(0).q()[static_cast<std::size_t>(bench.model().joints[joint].q)];
        const double off = engine->instance(0).drive_reference(s.joint) - q;
        EXPECT_GE(off, s.least - 1e-4) << bench.model().joints[joint].name;
        EXPECT_LE(off, s.most + 1e-4) << bench.model().joints[joint].name;
      }
    }
  }
}

TEST_P(IntegrationStepsTest, RandomPosesAreAtRestAtEveryStepSize) {
  Bench bench(GetParam());
  for (const double step : {0.001, 0.002, 0.005, 0.01, 0.02}) {
    const unsigned seed = 12;
    std::mt19937 random(seed);
    const auto engine = bench.engine(Integrator::euler, step);
    for (int i = 0; i < kPoses; ++i) {
      SCOPED_TRACE(std::to_string(step) + " s, seed " + std::to_string(seed) + ", pose " + std::to_string(i));
      start(*engine, bench.model(), bench.pose(random));
      run(*engine, 1.0);
      EXPECT_LT(fastest(*engine), 1e-3);
    }
  }
}

TEST_P(IntegrationStepsTest, MimicJointsKeepCouplingWhileGripperCloses) {
  Bench bench(GetParam());
  const Model& model = bench.model();
  const auto engine = bench.engine(Integrator::euler, 1e-3);
  bool any = false;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const ModelJoint& leader = model.joints[j];
    const bool led = std::any_of(model.joints.begin(), model.joints.end(), [j](const ModelJoint& joint) {
      return joint.mimic_leader == static_cast<int>(j);
    });
    if (!led || !std::isfinite(leader.lower) || !std::isfinite(leader.upper)) continue;
    any = true;
    Eigen::VectorXd q = model.neutral();
    q[leader.q] = leader.lower;
    model.apply_mimics(q);
    start(*engine, model, q);
    engine->instance(0).set_target(static_cast<int>(j), leader.upper);
    double angle = 0, way = 0;
    for (int i = 0; i < 5000; ++i) {
      engine->step();
      for (const ModelJoint& joint : model.joints) {
        if (joint.mimic_leader != static_cast<int>(j)) continue;
        const double stray = std::abs(engine->instance(0).q()[joint.q] - joint.mimic_offset -
                                      joint.mimic_multiplier * engine->instance(0).q()[leader.q]);
        double& worst = joint.type == JointType::prismatic ? way : angle;
        worst = std::max(worst, stray);
      }
    }
    EXPECT_NEAR(engine->instance(0).q()[leader.q], leader.upper, 0.02) << "expected the gripper to be closed";
    EXPECT_LT(angle, 1e-4) << leader.name;
    EXPECT_LT(way, 1e-5) << leader.name;
    RecordProperty(leader.name + "_rad", std::to_string(angle));
    RecordProperty(leader.name + "_m", std::to_string(way));
  }
  if (!any) GTEST_SKIP() << "the robot has no coupled joints";
}

// -- compared with the dynamics of kinematics/, integrated at 0.1 ms

// The arm alone: without friction, damping, limits and couplings.
RobotDescription bare(RobotDescription robot) {
  for (Joint& joint : robot.joints) {
    joint.dynamics.reset();
    if (joint.mimic || joint.type == JointType::prismatic) {  // fingers do not move
      joint.mimic.reset();
      joint.type = JointType::fixed;
    }
    if (joint.type == JointType::revolute) joint.type = JointType::continuous;
  }
  robot.gazebo.clear();
  return robot;
}

struct Fall {
  Diagnostics diagnostics;
  RobotDescription robot;
  std::shared_ptr<const Model> shared;
  const Model& model;

  explicit Fall(const Arm& arm)
      : robot(bare(CompiledScenario(arm.scenario, diagnostics).robots.front()->description())),
        shared(std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics))),
        model(*shared) {}
  std::unique_ptr<Engine> engine(Integrator integrator, double step) {
    InstanceOptions options;
    options.self_collision = false;
    return alone(robot, shared, options, integrator, step, diagnostics);
  }
  Eigen::VectorXd pose(std::mt19937& random) const {
    std::uniform_real_distribution<double> angle(-2, 2);
    return Eigen::VectorXd::NullaryExpr(model.nq, [&] { return angle(random); });
  }
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Short arms fall fast: for the bundled ones alone, of 0.3 m, the allowed error is four times that of the
// corpus's arms of 0.6 to 1.2 m.
struct Falling {
  std::vector<Arm> arms = listed_arms();
  double slack = 1;
  Falling() {
    if (arms.empty()) {
      arms = find_arms();
      slack = 4;
    } else {
      arms.push_back({"omarm_one", scenario_of("omarm_one")});
    }
  }
};

// Over the joints of all arms, after half a second of falling from random poses, up to 2 rad from zero.
TEST(CorpusIntegrationSteps, PassiveFallMatchesReference) {
  const std::map<Integrator, double> allowed{{Integrator::euler, 6e-2},
                                             {Integrator::implicit, 6e-2},
                                             {Integrator::midpoint, 1e-3},
                                             {Integrator::rk4, 1e-7}};
  std::map<Integrator, std::vector<double>> all;
  const Falling falling;
  for (const Arm& arm : falling.arms) {
    Fall fall(arm);
    std::map<Integrator, std::vector<double>> errors;
    std::mt19937 random(13);
    test::ReferenceMotion reference(fall.model, {0, 0, -9.81});
    for (int i = 0; i < kPoses; ++i) {
      const Eigen::VectorXd q0 = fall.pose(random);
      test::Motion exact{q0, Eigen::VectorXd::Zero(fall.model.nv)};
      const auto free = [&fall](const test::Motion&) { return Eigen::VectorXd::Zero(fall.model.nv).eval(); };
      for (int k = 0; k < 5000; ++k) reference.step(exact, 1e-4, free);
      for (const Integrator integrator : kAll) {
        const auto engine = fall.engine(integrator, 1e-3);
        const std::vector<double> rest(static_cast<std::size_t>(fall.model.nv), 0.0);
        engine->instance(0).set_state({q0.data(), static_cast<std::size_t>(q0.size())}, rest);
        run(*engine, 0.5);
        for (int k = 0; k < fall.model.nq; ++k)
          errors[integrator].push_back(
              std::abs(engine->instance(0).q()[static_cast<std::size_t>(k)] - exact.q[k]));
      }
    }
    std::printf("  %-18s", arm.name.c_str());
    for (auto& [integrator, of] : errors) {
      std::printf(" %s %.1e", name_of(integrator), median(of));
      all[integrator].insert(all[integrator].end(), of.begin(), of.end());
    }
    std::printf(" rad\n");
  }
  for (const auto& [integrator, of] : all) {
    const char* const name = name_of(integrator);
    std::printf("  all: %-9s median %.2g rad at 1 ms, seed 13\n", name, median(of));
    EXPECT_LT(median(of), falling.slack * allowed.at(integrator)) << name;
  }
}

TEST(CorpusIntegrationSteps, PassiveFallConservesEnergy) {
  const Falling falling;
  for (const auto& [integrator, allowed] :
       {std::pair{Integrator::midpoint, 1e-3}, std::pair{Integrator::rk4, 1e-6}}) {
    std::vector<double> drifts;
    for (const Arm& arm : falling.arms) {
      Fall fall(arm);
      std::mt19937 random(14);
      for (int i = 0; i < kPoses; ++i) {
        const auto engine = fall.engine(integrator, 1e-3);
        const Eigen::VectorXd q0 = fall.pose(random);
        const std::vector<double> rest(static_cast<std::size_t>(fall.model.nv), 0.0);
        engine->instance(0).set_state({q0.data(), static_cast<std::size_t>(q0.size())}, rest);
        const double before = engine->potential_energy();
        double moving = 0, worst = 0;
        for (int k = 0; k < 2000; ++k) {
          engine->step();
          const double kinetic = engine->kinetic_energy();
          moving = std::max(moving, kinetic);
          worst = std::max(worst, std::abs(kinetic + engine->potential_energy() - before));
        }
        drifts.push_back(worst / moving);
      }
    }
    std::printf("  %-9s median drift over 2 s at 1 ms: %.2g of the largest kinetic energy, seed 14\n",
                name_of(integrator), median(drifts));
    EXPECT_LT(median(drifts), falling.slack * allowed);
  }
}

// Commands at 1 kHz along a quintic of 1 s; between them, at a finer step, the drives interpolate.
std::vector<Eigen::VectorXd> track(Engine& engine, const Model& model, const Eigen::VectorXd& from,
                                   const Eigen::VectorXd& to, double step) {
  start(engine, model, from);
  std::vector<Eigen::VectorXd> out;
  const int substeps = static_cast<int>(std::lround(1e-3 / step));
  for (int i = 1; i <= 1000; ++i) {
    const double s = 1e-3 * i, blend = s * s * s * (10 + s * (6 * s - 15));
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const ModelJoint& joint = model.joints[j];
      if (joint.scalar() && !joint.mimics())
        engine.instance(0).set_target(static_cast<int>(j),
                                      from[joint.q] + blend * (to[joint.q] - from[joint.q]));
    }
    for (int k = 0; k < substeps; ++k) engine.step();
    out.emplace_back(Eigen::Map<const Eigen::VectorXd>(engine.instance(0).q().data(), model.nq));
  }
  return out;
}

// The distance from `from` towards `to` that a quintic of 1 s covers at 80 % of the velocity limits and 3
// rad/s.
Eigen::VectorXd within_speed(const Model& model, const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  double share = 1;
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar()) continue;
    const double peak = 15.0 / 8.0 * std::abs(to[joint.q] - from[joint.q]);
    share = std::min(share, std::min(0.8 * joint.velocity, 3.0) / std::max(peak, 1e-9));
  }
  return from + share * (to - from);
}

TEST_P(IntegrationStepsTest, QuinticAtOneMillisecondMatchesFinerStep) {
  Bench bench(GetParam());
  for (const Integrator integrator : kAll) {
    const unsigned seed = 15;
    std::mt19937 random(seed);
    const auto coarse = bench.engine(integrator, 1e-3), fine = bench.engine(Integrator::euler, 2e-5);
    const Eigen::VectorXd from = bench.pose(random);
    const Eigen::VectorXd to = within_speed(bench.model(), from, bench.pose(random));
    const auto a = track(*coarse, bench.model(), from, to, 1e-3);
    const auto b = track(*fine, bench.model(), from, to, 2e-5);
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]).squaredNorm() / bench.model().nq;
    const double rms = std::sqrt(squares / static_cast<double>(a.size()));
    std::printf("  %-10s %-9s quintic of 1 s at 1 ms, against 0.02 ms: %.2g rad rms\n",
                GetParam().name.c_str(), name_of(integrator), rms);
    EXPECT_LT(rms, 1e-4);
  }
}

std::string test_name(const ::testing::TestParamInfo<Arm>& arm) {
  std::string name = arm.param.name;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Arms, IntegrationStepsTest, ::testing::ValuesIn(find_arms()), test_name);

}  // namespace
}  // namespace doppel
