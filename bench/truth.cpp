// Tables of bounces, sliding, rolling, spinning wheels and drives at their limit, each beside its closed form.
//   build/bin/bench_truth [engine]
//   build/bin/bench_truth motion URDF fall|hold
// The latter prints the motion of a robot in JSON, for tests/mujoco3/compare.mjs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "doppel/description/urdf/load.h"
#include "doppel/physics/contract/engine_modules.h"

namespace {

using doppel::Engine;
using doppel::Instance;
using doppel::Pose;

constexpr double kGravity = 9.81;  // m/s^2
constexpr double kStep = 1e-3;     // s

std::string engine_name = doppel::kDefaultEngine;

Pose pose(const Eigen::Vector3d& xyz, double tilt = 0) {
  Pose out = Pose::Identity();
  out.translation() = xyz;
  out.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return out;
}

doppel::WorldObject object(const std::string& name, const doppel::Geometry& shape, const Pose& X_WO,
                           double mass, double friction) {
  doppel::WorldObject out;
  out.name = name;
  out.shape = shape;
  out.X_WO = X_WO;
  out.mass = mass;
  out.friction = friction;
  return out;
}

std::unique_ptr<Engine> world_of(const doppel::WorldSettings& settings,
                                 const std::vector<doppel::WorldObject>& objects) {
  doppel::Diagnostics diagnostics;
  doppel::CollisionMeshes meshes;
  std::vector<doppel::ModelInstance> instances;
  for (const doppel::WorldObject& of : objects)
    instances.push_back(doppel::make_instance(of, meshes, diagnostics));
  return doppel::compile_world(engine_name, settings, std::move(instances), diagnostics)->make_engine();
}

std::unique_ptr<Engine> world_of(const doppel::WorldSettings& settings, doppel::RobotDescription robot,
                                 doppel::BaseKind base, const doppel::InstanceOptions& options) {
  doppel::Diagnostics diagnostics;
  doppel::CollisionMeshes meshes;
  const auto described = std::make_shared<const doppel::RobotDescription>(std::move(robot));
  const auto model =
      std::make_shared<const doppel::Model>(doppel::compile_model(*described, base, diagnostics));
  return doppel::compile_world(engine_name, settings,
                               {doppel::make_instance(described, model, options, meshes, diagnostics)},
                               diagnostics)
      ->make_engine();
}

void row(const std::string& what, double expected, double measured) {
  const double error = expected == 0 ? measured : 100 * (measured / expected - 1);
  fmt::print("  {:58s} {:10.5f} {:10.5f} {:+9.3f} {}\n", what, expected, measured, error,
             expected == 0 ? "" : "%");
}

// -- bounces

double rebound(const doppel::Geometry& shape, double restitution) {
  doppel::WorldSettings settings;
  doppel::WorldObject body = object("body", shape, pose({0, 0, 1.1}), 0.5, 0.8);
  body.restitution = restitution;
  const auto engine = world_of(settings, {body});
  double down = 0, up = 0;
  for (int i = 0; i < 600; ++i) {
    const double v = engine->instance(0).base_velocity().linear_W.z();
    down = std::min(down, v);
    up = std::max(up, v);
    engine->step();
  }
  return -up / down;
}

void bounces() {
  fmt::print("speed after over speed before an impact, dropped by 1 m         expected   measured\n");
  for (const double e : {0.0, 0.25, 0.5, 0.8, 1.0}) {
    row(fmt::format("ball, restitution {}", e), e, rebound(doppel::Sphere{0.1}, e));
    row(fmt::format("box, restitution {}", e), e, rebound(doppel::Box{{0.2, 0.2, 0.2}}, e));
  }
}

// -- slopes

struct Slope {
  double angle = 0;  // rad
  bool slab = true;  // a box that is tilted; false: the ground, with tilted gravity
  doppel::FrictionRule rule = doppel::FrictionRule::larger;
};

struct Descent {
  double acceleration = 0;  // m/s^2, between 0.5 and 1.5 s
  double turning = 0;       // rad/s, the largest in that time
};

// The shape starts at rest on a slope that falls along x.
Descent descend(const Slope& slope, const doppel::Geometry& shape, double height, double friction,
                const Eigen::Matrix3d& R_SO = Eigen::Matrix3d::Identity()) {
  doppel::WorldSettings settings;
  settings.friction_rule = slope.rule;
  settings.ground_friction = friction;
  std::vector<doppel::WorldObject> objects;
  Pose X_WS = Pose::Identity();
  if (slope.slab) {
    settings.ground = false;
    X_WS = pose({0, 0, 0}, slope.angle);
    objects.push_back(object("slab", doppel::Box{{20, 4, 0.2}}, X_WS * pose({0, 0, -0.1}), 0, friction));
  } else {
    settings.gravity = kGravity * Eigen::Vector3d(std::sin(slope.angle), 0, -std::cos(slope.angle));
  }
  Pose X_SO = pose({-3, 0, height});
  X_SO.linear() = R_SO;
  objects.push_back(object("body", shape, X_WS * X_SO, 1.0, friction));
  const auto engine = world_of(settings, objects);
  const Instance body = *engine->find("body");
  const Eigen::Vector3d along = X_WS.linear().col(0);
  const auto speed = [&] { return along.dot(body.base_velocity().linear_W); };
  Descent out;
  double before = 0;
  for (int i = 0; i < 1500; ++i) {
    if (i == 500) before = speed();
    engine->step();
    if (i >= 500) out.turning = std::max(out.turning, body.base_velocity().angular_W.norm());
  }
  out.acceleration = speed() - before;
  return out;
}

constexpr double kDegree = std::numbers::pi / 180;

void sliding() {
  fmt::print("a box of 0.2 m slides on a slope, m/s^2\n");
  const doppel::Box box{{0.2, 0.2, 0.2}};
  for (const auto& [degrees, friction] : {std::pair{20.0, 0.3}, {20.0, 0.355}, {10.0, 0.1}, {30.0, 0.5}}) {
    const double angle = degrees * kDegree, exact = kGravity * (std::sin(angle) - friction * std::cos(angle));
    for (const Slope& slope :
         {Slope{angle, false}, Slope{angle, true}, Slope{angle, true, doppel::FrictionRule::smaller}}) {
      const Descent found = descend(slope, box, 0.1, friction);
      row(fmt::format("{} degrees, friction {}, {} (turns by {:.4f} rad/s)", degrees, friction,
                      !slope.slab                                   ? "plane"
                      : slope.rule == doppel::FrictionRule::smaller ? "box, rule min"
                                                                    : "box",
                      found.turning),
          exact, found.acceleration);
    }
  }
}

void rolling() {
  fmt::print("round bodies of radius 0.1 m roll on a slope of 10 degrees, m/s^2\n");
  const double angle = 10 * kDegree, fall = kGravity * std::sin(angle);
  const Eigen::Matrix3d lying =
      Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (const Slope& slope :
       {Slope{angle, false}, Slope{angle, true}, Slope{angle, true, doppel::FrictionRule::smaller}}) {
    const char* const on = !slope.slab                                   ? "plane"
                           : slope.rule == doppel::FrictionRule::smaller ? "box, rule min"
                                                                         : "box";
    row(fmt::format("sphere, {}", on), fall * 5 / 7,
        descend(slope, doppel::Sphere{0.1}, 0.1, 0.8).acceleration);
    row(fmt::format("cylinder, {}", on), fall * 2 / 3,
        descend(slope, doppel::Cylinder{0.1, 0.2}, 0.1, 0.8, lying).acceleration);
  }
}

// -- drives

// A hinge of 0.28 kg m^2 without gravity, whose targets move at its limit of 2 rad/s.
doppel::RobotDescription hinge() {
  doppel::RobotDescription out;
  out.name = "hinge";
  out.links.resize(2);
  out.links[0].name = "post";
  out.links[1].name = "arm";
  out.links[1].inertial.emplace();
  out.links[1].inertial->mass = 1.0;
  out.links[1].inertial->ixx = out.links[1].inertial->iyy = out.links[1].inertial->izz = 0.28;
  doppel::Joint joint;
  joint.name = "hinge";
  joint.type = doppel::JointType::revolute;
  joint.parent = "post";
  joint.child = "arm";
  joint.axis = Eigen::Vector3d::UnitY();
  joint.limits.emplace();
  joint.limits->lower = -4;
  joint.limits->upper = 4;
  joint.limits->effort = 300;
  joint.limits->velocity = 2;
  out.joints.push_back(joint);
  return out;
}

void drives() {
  fmt::print("a joint follows targets at its velocity limit through 0.125 to 2 rad, rad/s\n");
  for (const double hertz : {100.0, 500.0, 1000.0}) {
    doppel::WorldSettings settings;
    settings.gravity.setZero();
    settings.ground = false;
    doppel::InstanceOptions options;
    options.gravity.setZero();
    const auto engine = world_of(settings, hinge(), doppel::BaseKind::fixed, options);
    Instance arm = engine->instance(0);
    arm.set_drive(0, doppel::DriveMode::position);
    const int gap = static_cast<int>(std::lround(1 / (kStep * hertz)));
    double target = 0, first = 0, later = 0;
    for (int i = 0; i < 2000; ++i) {
      if (i % gap == 0) arm.set_target(0, target = std::min(target + 2 / hertz, 2.3));
      engine->step();
      (i < 200 ? first : later) = std::max(i < 200 ? first : later, arm.v()[0]);
    }
    row(fmt::format("{} Hz, largest in 0.2 s (2 to {:.3f} is possible)", hertz, 2 * (1 + std::exp(-2.0))), 2,
        first);
    row(fmt::format("{} Hz, largest later", hertz), 2, later);
  }
}

// -- wheels

constexpr double kWheelRadius = 0.1, kCaster = 0.3, kCentre = 0.1;  // m, the last two before the axle
constexpr double kBodyMass = 10.0, kWheelMass = 0.5;                // kg

doppel::Link link_of(const std::string& name, double mass, const Eigen::Vector3d& centre,
                     const Eigen::Vector3d& moments) {
  doppel::Link out;
  out.name = name;
  doppel::Inertial& inertial = out.inertial.emplace();
  inertial.mass = mass;
  inertial.origin.xyz = centre;
  inertial.ixx = moments.x();
  inertial.iyy = moments.y();
  inertial.izz = moments.z();
  return out;
}

doppel::Joint joint_of(const doppel::Link& child, doppel::JointType type, const Eigen::Vector3d& at) {
  doppel::Joint out;
  out.name = child.name + "_joint";
  out.type = type;
  out.parent = "base_link";
  out.child = child.name;
  out.origin.xyz = at;
  out.axis = Eigen::Vector3d::UnitY();
  return out;
}

// Two driven wheels, and a ball before them, which the acceleration relieves.
doppel::RobotDescription base_on_wheels(double friction) {
  doppel::RobotDescription out;
  out.name = "base";
  out.links.push_back(link_of("base_link", kBodyMass, {kCentre, 0, 0}, {0.1, 0.2, 0.2}));
  doppel::Link ball = link_of("ball", 0.1, {0, 0, 0}, {1e-4, 1e-4, 1e-4});
  ball.collisions.push_back({"", {}, doppel::Sphere{0.05}, {}});
  out.joints.push_back(joint_of(ball, doppel::JointType::fixed, {kCaster, 0, 0.05 - kWheelRadius}));
  out.links.push_back(ball);
  const double along = kWheelMass * kWheelRadius * kWheelRadius / 2;
  for (const double side : {1.0, -1.0}) {
    doppel::Link wheel =
        link_of(side > 0 ? "left" : "right", kWheelMass, {0, 0, 0}, {along / 2, along, along / 2});
    wheel.collisions.push_back(
        {"", {{}, {std::numbers::pi / 2, 0, 0}, {}}, doppel::Cylinder{kWheelRadius, 0.04}, {}});
    out.joints.push_back(joint_of(wheel, doppel::JointType::continuous, {0, 0.2 * side, 0}));
    out.links.push_back(wheel);
    doppel::GazeboExtension surface;
    surface.reference = wheel.name;
    surface.surface.mu = friction;
    out.gazebo.push_back(surface);
  }
  return out;
}

void spinning_wheels() {
  fmt::print("a base of 11.1 kg whose wheels spin at 4 m/s, by friction times load\n");
  for (const double friction : {0.2, 0.3, 0.5}) {
    doppel::WorldSettings settings;
    settings.ground_friction = friction;
    doppel::InstanceOptions options;
    options.set_on_ground = true;
    const auto engine = world_of(settings, base_on_wheels(friction), doppel::BaseKind::floating, options);
    Instance base = engine->instance(0);
    for (int i = 0; i < 300; ++i) engine->step();
    const int left = base.model().find_joint("left_joint");
    for (const int wheel : {left, base.model().find_joint("right_joint")}) {
      base.set_drive(wheel, doppel::DriveMode::velocity);
      base.set_target(wheel, 4 / kWheelRadius);
    }
    double before = 0, least = doppel::kInfinity, most = 0;
    for (int i = 0; i < 600; ++i) {
      if (i == 400) before = base.base_velocity().linear_W.x();
      engine->step();
      if (i < 400) continue;
      const double effort = base.drive_effort()[static_cast<std::size_t>(left)];
      least = std::min(least, effort);
      most = std::max(most, effort);
    }
    // N_ball = m (g centre - a height) / kCaster,  m a = mu (m g - N_ball) - 0.05 N_ball
    const double mass = kBodyMass + 2 * kWheelMass + 0.1, both = (friction + 0.05) / kCaster;
    const double centre = (kBodyMass * kCentre + 0.1 * kCaster) / mass;
    const double height = kWheelRadius - 0.1 * (kWheelRadius - 0.05) / mass;
    const double a = kGravity * (friction - both * centre) / (1 - both * height);
    const double load = mass * (kGravity - (kGravity * centre - a * height) / kCaster);
    row(fmt::format("friction {}, acceleration, m/s^2", friction), a,
        (base.base_velocity().linear_W.x() - before) / 0.2);
    row(fmt::format("friction {}, least effort of a wheel, N m", friction),
        friction * load * kWheelRadius / 2, least);
    row(fmt::format("friction {}, largest effort of a wheel, N m", friction),
        friction * load * kWheelRadius / 2, most);
  }
}

// -- the motion of a robot

int print_motion(const std::string& file, const std::string& kind) {
  doppel::Diagnostics diagnostics;
  doppel::CollisionMeshes meshes;
  doppel::PackageResolver packages;
  const auto described = std::make_shared<const doppel::RobotDescription>(
      doppel::load_description(file, {}, packages, diagnostics).robot);
  const auto compiled = std::make_shared<const doppel::Model>(
      doppel::compile_model(*described, doppel::BaseKind::fixed, diagnostics));
  doppel::WorldSettings settings;
  settings.ground = false;
  const auto engine = doppel::compile_world(
                          doppel::kDefaultEngine, settings,
                          {doppel::make_instance(described, compiled, {}, meshes, diagnostics)}, diagnostics)
                          ->make_engine();
  Instance moving = engine->instance(0);
  const doppel::Model& model = moving.model();
  std::vector<double> q(moving.q().begin(), moving.q().end());
  const std::vector<double> still(static_cast<std::size_t>(model.nv), 0.0);
  nlohmann::json out;
  double offset = 0.3;
  for (const doppel::ModelJoint& joint : model.joints) {
    if (!joint.scalar()) continue;
    out["joints"].push_back(joint.name);
    double& of = q[static_cast<std::size_t>(joint.q)];
    if (joint.mimics()) continue;
    const double range = std::isfinite(joint.upper - joint.lower) ? joint.upper - joint.lower : 2.0;
    of = std::clamp(of + offset * std::min(range, 1.0), joint.lower + 0.1 * range, joint.upper - 0.1 * range);
    offset = -0.8 * offset;
  }
  moving.set_state(q, still);
  if (kind == "hold") {
    for (const std::string& name : model.driven_joint_names())
      moving.set_drive(model.find_joint(name), doppel::DriveMode::position);
  }
  const auto sample = [&](double t) {
    nlohmann::json positions;
    for (const doppel::ModelJoint& joint : model.joints) {
      if (joint.scalar()) positions.push_back(moving.q()[static_cast<std::size_t>(joint.q)]);
    }
    out["samples"].push_back({{"t", t}, {"q", positions}});
  };
  sample(0);
  for (int i = 1; i <= 500; ++i) {
    engine->step();
    if (i % 50 == 0) sample(kStep * i);
  }
  fmt::print("{}\n", out.dump());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 3 && words[0] == "motion") return print_motion(words[1], words[2]);
  if (!words.empty()) engine_name = words[0];
  bounces();
  sliding();
  rolling();
  spinning_wheels();
  drives();
  return 0;
}
