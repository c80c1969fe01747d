#include "doppel/scenario/compile/compiled_scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "doppel/base/core/names.h"
#include "doppel/control/manager/rates.h"
#include "doppel/description/gazebo/model_plugins.h"
#include "doppel/description/gazebo/plugin_values.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/scenario/resolve/controllers_file.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxLinksNamed = 8;

bool among(const std::vector<WorldRobot>& robots, const std::string& name_space) {
  return std::ranges::find(robots, name_space, &WorldRobot::name_space) != robots.end();
}

// The robots of the scenario and the world file, without those that were deleted at run time.
std::vector<WorldRobot> robots_asked_for(const Scenario& scenario, const World& world,
                                         const RunningRobots* running, Diagnostics& diagnostics) {
  std::vector<WorldRobot> all = scenario.robots;
  std::ranges::copy_if(world.robots, std::back_inserter(all),
                       [&](const WorldRobot& robot) { return !scenario.complete || !robot.model.empty(); });
  name_robots(all, diagnostics);
  if (running == nullptr) return all;
  const std::size_t named = scenario.robots.size();
  std::vector<WorldRobot> out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool runs = std::ranges::any_of(
        running->now, [&](const auto& robot) { return robot->name_space() == all[i].name_space; });
    const bool known = i < named || among(running->in_file, all[i].name_space);
    if (runs || !known) out.push_back(all[i]);
  }
  return out;
}

std::optional<BaseKind> running_base(const RunningRobots* running, const std::string& name_space) {
  if (running == nullptr) return std::nullopt;
  for (const auto& robot : running->now) {
    if (robot->name_space() == name_space) return robot->base();
  }
  return std::nullopt;
}

void refuse_name(const WorldRobot& robot, const std::string& why, const std::string& what_to_do) {
  throw InputError("up.namespace", robot.source, fmt::format("the namespace '{}' {}", robot.name_space, why),
                   what_to_do);
}

// "omarm_one_2" for a second robot of a target without a given namespace.
std::string free_namespace(const WorldRobot& robot, const std::vector<WorldRobot>& all) {
  std::string base;
  for (const char c : std::filesystem::path(robot.target).stem().string()) {
    const bool allowed = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
    base += allowed ? c : '_';
  }
  if (base.empty() || std::isdigit(static_cast<unsigned char>(base.front())) != 0) base = "robot_" + base;
  for (int i = 2;; ++i) {
    std::string name = fmt::format("{}_{}", base, i);
    if (!among(all, name)) return name;
  }
}

const SdfModel* model_named(const std::vector<SdfModel>& models, const std::string& name) {
  const auto found = std::ranges::find(models, name, &SdfModel::name);
  return found == models.end() ? nullptr : &*found;
}

// The instances of models that are no robots, and their sensors.
std::shared_ptr<const std::vector<ModelSensors>> add_models(const std::vector<SdfModel>& models,
                                                            CollisionMeshes& meshes,
                                                            std::vector<ModelInstance>& instances,
                                                            Diagnostics& diagnostics) {
  auto out = std::make_shared<std::vector<ModelSensors>>();
  for (const SdfModel& model : models) {
    instances.push_back(make_instance(model, "", meshes, diagnostics));
    RobotSensors sensors = find_sensors(model, *instances.back().model, diagnostics);
    if (!sensors.sensors.empty())
      out->push_back({instances.back().name, model.is_static, std::move(sensors)});
  }
  return out;
}

}  // namespace

std::string free_model_namespace(const std::string& wanted, const std::string& model,
                                 const std::vector<std::string>& taken) {
  const auto is_taken = [&](const std::string& name) {
    return std::ranges::find(taken, name) != taken.end();
  };
  if (!is_taken(wanted)) return wanted;
  const std::string base = valid_topic(wanted.empty() ? model : wanted);
  std::string name = base;
  for (int i = 2; is_taken(name); ++i) name = fmt::format("{}_{}", base, i);
  return name;
}

void name_robots(std::vector<WorldRobot>& robots, Diagnostics& diagnostics) {
  bool unnamed = false;
  std::set<std::string> taken;
  for (WorldRobot& robot : robots) {
    if (robot.name_space.empty()) {
      if (!std::exchange(unnamed, true)) continue;
      robot.name_space = free_namespace(robot, robots);
      diagnostics.note("up.namespace_given", robot.source,
                       fmt::format("the additional robot '{}' has no namespace; it gets '{}'", robot.target,
                                   robot.name_space),
                       "choose one with --robot TARGET:NAMESPACE, or `namespace:` in the world file");
    }
    if (const Status fine = check_namespace("/" + robot.name_space); !fine)
      refuse_name(robot, "cannot be used: " + fine.why(), "use letters, digits and _ in a namespace");
    if (!taken.insert(robot.name_space).second)
      refuse_name(robot, "is used for two robots", "give each its own namespace");
  }
}

Instance instance_of(Engine& engine, const CompiledRobot& robot) {
  const std::optional<Instance> found = engine.find(robot.name());
  if (!found) throw std::logic_error("the engine has no robot '" + robot.name() + "'");
  return *found;
}

namespace {

// At the first sensor of positions, where the world does not say where it is on Earth.
void note_missing_place(const CompiledScenario& scenario, Diagnostics& diagnostics) {
  if (scenario.earth.is_given) return;
  std::vector<const RobotSensors*> all;
  for (const auto& robot : scenario.robots) all.push_back(&robot->sensors());
  for (const ModelSensors& model : *scenario.model_sensors) all.push_back(&model.sensors);
  for (const RobotSensors* of : all) {
    for (const RobotSensor& sensor : of->sensors) {
      const auto* const environment = std::get_if<EnvironmentDescription>(&sensor.description.what);
      if (environment == nullptr || environment->kind != EnvironmentKind::navsat) continue;
      diagnostics.note(
          "sensor.no_place", sensor.description.source,
          fmt::format("the world does not say where it is on Earth; '{}' reads its origin as 0 N, 0 E, "
                      "0 m",
                      sensor.description.name),
          "write <spherical_coordinates> with <latitude_deg>, <longitude_deg> and <elevation> in the "
          "<world> of an SDF file");
      return;
    }
  }
}

}  // namespace

namespace {

std::uint64_t next_number() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

CompiledScenario::CompiledScenario(const Scenario& scenario, Diagnostics& diagnostics,
                                   const RunningRobots* running)
    : number(next_number()) {
  resolver.add_bundled(scenario.bundled_robots);
  for (const WorldRobot& robot : scenario.robots)
    resolver.add_context(resolve_target(robot.target, scenario.bundled_robots).description);
  std::vector<SdfModel> models = read_world(scenario, diagnostics);
  find_driven(models, scenario, diagnostics);
  const std::vector<WorldRobot> asked = robots_asked_for(scenario, world, running, diagnostics);
  if (asked.empty() && !scenario.world && running == nullptr) {
    throw InputError("up.no_robot", {}, "neither a robot nor a world is given",
                     "give one: doppel up TARGET, or doppel up --world FILE");
  }
  CollisionMeshes meshes;
  std::vector<std::shared_ptr<CompiledRobot>> fresh;
  for (const WorldRobot& robot : asked) {
    if (!robot.model.empty()) {
      fresh.push_back(std::make_shared<CompiledRobot>(
          robot, scenario, world, *model_named(models, robot.model), robot.model, meshes, diagnostics));
      continue;
    }
    fresh.push_back(std::make_shared<CompiledRobot>(
        robot, scenario, world, running_base(running, robot.name_space), resolver, meshes, diagnostics));
  }
  // Models that a plugin drives have become robots above and are no objects any more.
  std::erase_if(models, [this](const SdfModel& model) {
    return std::ranges::find(world.robots, model.name, &WorldRobot::model) != world.robots.end();
  });
  robots.assign(fresh.begin(), fresh.end());
  if (running != nullptr) {
    std::ranges::copy_if(running->now, std::back_inserter(robots),
                         [](const auto& robot) { return robot->from_text(); });
  }
  if (scenario.step) {
    world.step = *scenario.step;
  } else {
    choose_step(diagnostics);
  }
  std::vector<ModelInstance> instances;
  for (const auto& robot : robots) instances.push_back(robot->instance());
  const std::size_t robot_count = instances.size();
  for (const WorldObject& object : world.objects)
    instances.push_back(make_instance(object, meshes, diagnostics));
  model_sensors = add_models(models, meshes, instances, diagnostics);
  for (std::size_t i = robot_count; i < instances.size(); ++i) in_file.push_back(instances[i].name);
  engine = compile_world(scenario.engine, static_cast<const WorldSettings&>(world), std::move(instances),
                         diagnostics)
               ->make_engine();
  for (const auto& robot : fresh) robot->report_choices(instance_of(*engine, *robot), diagnostics);
  for (const auto& robot : fresh) report_overlaps(*robot, *engine, diagnostics);
  note_missing_place(*this, diagnostics);
}

// A world file of either format; the models of an SDF file.
std::vector<SdfModel> CompiledScenario::read_world(const Scenario& scenario, Diagnostics& diagnostics) {
  if (!scenario.world) return {};
  const std::filesystem::path file = find_world(scenario.world->string(), resolver);
  if (!is_sdf(file)) {
    world = load_world(file, resolver);
    keep_out = load_keep_out(file, resolver);
    included = {file};
    return {};
  }
  SdfWorld read = load_sdf(file, resolver, diagnostics);
  static_cast<WorldSettings&>(world) = read.settings;
  earth = read.earth;
  included = std::move(read.files);
  return std::move(read.models);
}

void CompiledScenario::choose_step(Diagnostics& diagnostics) {
  if (world.step_is_given) return;
  // The default step of 1 ms does not divide every manager's rate, such as 300 Hz; a nearby step
  // that does is better than a rounded rate, of which controllers know nothing.
  std::vector<double> rates;
  const ControllersFile* uneven = nullptr;
  std::vector<ControllersFile> files;
  files.reserve(robots.size());
  for (const auto& robot : robots) {
    const ControllersFile& file = files.emplace_back(controllers_in(robot->setup().controllers));
    if (!(file.update_rate > 0)) continue;
    rates.push_back(file.update_rate);
    const bool divides =
        !differs(file.update_rate, rate_of(world.step * steps_per_period(file.update_rate, world.step)));
    if (!divides && uneven == nullptr) uneven = &file;
  }
  if (uneven == nullptr) return;
  const std::optional<Duration> step = step_for_rates(rates, world.step);
  if (!step) return;  // each controller manager reports its rounded rate
  diagnostics.note(
      "control.step_chosen", uneven->rate_where,
      fmt::format(
          "the physics step is {:.9g} ms instead of {:g} ms, so that controllers run at their {:g} Hz",
          to_seconds(*step) * 1e3, to_seconds(world.step) * 1e3, uneven->update_rate),
      "`step:` in a world file sets another one");
  world.step = *step;
}

// Models whose plugins drive them are robots of the world.
void CompiledScenario::find_driven(const std::vector<SdfModel>& models, const Scenario& scenario,
                                   Diagnostics& diagnostics) {
  std::vector<std::string> taken;
  for (const WorldRobot& robot : scenario.robots) taken.push_back(robot.name_space);
  for (const SdfModel& model : models) {
    if (model.description->gazebo.empty()) continue;
    Diagnostics said;
    const auto mapped = map_model_plugins(*model.description, world.name, said);
    if (!mapped) {
      for (const Diagnostic& d : said.all()) diagnostics.add(d);
      continue;
    }
    WorldRobot robot;
    robot.model = model.name;
    robot.name_space = free_model_namespace(mapped->name_space, model.name, taken);
    robot.X_WR = model.X_WR;
    robot.base = model.base;
    robot.source = model.source;
    taken.push_back(robot.name_space);
    world.robots.push_back(std::move(robot));
  }
}

std::shared_ptr<const CompiledRobot> CompiledScenario::find(std::string_view name_space) const {
  const auto found =
      std::ranges::find_if(robots, [&](const auto& robot) { return robot->name_space() == name_space; });
  return found == robots.end() ? nullptr : *found;
}

std::vector<std::filesystem::path> CompiledScenario::files() const {
  std::vector<std::filesystem::path> out;
  for (const auto& robot : robots) {
    for (std::filesystem::path& file : robot->files()) out.push_back(std::move(file));
  }
  out.insert(out.end(), included.begin(), included.end());
  return out;
}

void report_overlaps(const CompiledRobot& robot, const Engine& engine, Diagnostics& diagnostics) {
  struct Inside {
    std::vector<std::string> links;
    double deepest = 0;
  };
  const CompiledWorld& world = engine.world();
  const int here = world.find(robot.name());
  std::map<int, Inside> inside;  // by the instance that contains them; -1: the ground
  for (const ExcludedPair& pair : world.excluded_pairs()) {
    if (!(pair.depth > 0) || pair.a.instance == pair.b.instance) continue;
    const bool first = pair.a.instance == here;
    if (!first && pair.b.instance != here) continue;
    const BodyId own = first ? pair.a : pair.b, other = first ? pair.b : pair.a;
    const bool robots_pair =
        !other.is_ground() && !world.instances()[static_cast<std::size_t>(other.instance)].is_object();
    if (robots_pair && other.instance < here) continue;  // reported for the other robot
    Inside& in = inside[other.instance];
    in.links.push_back(robot.model().links[static_cast<std::size_t>(own.link)].name);
    in.deepest = std::max(in.deepest, pair.depth);
  }
  for (const auto& [other, in] : inside) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < std::min(in.links.size(), kMaxLinksNamed); ++i)
      names.push_back(fmt::format("'{}'", in.links[i]));
    if (in.links.size() > names.size())
      names.push_back(fmt::format("{} more", in.links.size() - names.size()));
    const bool ground = other < 0;
    const ModelInstance* const what = ground ? nullptr : &world.instances()[static_cast<std::size_t>(other)];
    const Link* const first = robot.description().find_link(in.links.front());
    diagnostics.warning(
        "up.starts_inside", first != nullptr ? first->source : robot.description().source,
        fmt::format("{} up to {:.3g} m inside {}: {}; collisions between them are disabled",
                    in.links.size() == 1 ? "a link starts" : fmt::format("{} links start", in.links.size()),
                    in.deepest,
                    ground ? "the ground"
                           : fmt::format("the {} '{}'", what->is_object() ? "object" : "robot", what->name),
                    fmt::join(names, ", ")),
        ground ? "place the robot higher in a world file (robot: {xyz: [0, 0, 0.5]}), or use --base floating"
               : "move the object or the robot in the world file");
  }
}

namespace {

// A joint that moved, or followed another one, and would be fixed or independent after an edit.
std::optional<Diagnostic> lost_motion(const ModelJoint& old, const ModelJoint& joint,
                                      const CompiledRobot& to) {
  const Joint* const source = to.description().find_joint(joint.name);
  if (source == nullptr) return std::nullopt;
  Diagnostic problem;
  problem.rule = "reload.motion";
  if (old.mimics() && !joint.mimics() && source->mimic) {
    problem.where = source->mimic->source;
    problem.message = fmt::format("joint '{}' would no longer mimic '{}'{}", joint.name, source->mimic->joint,
                                  did_you_mean(source->mimic->joint, to.model().scalar_joint_names()));
    problem.fix = "correct the <mimic>, or remove it";
  } else if (old.scalar() && joint.type == JointType::fixed && source->type != JointType::fixed) {
    problem.where = source->axis_source;
    problem.message = fmt::format("joint '{}' would not move: its axis is zero", joint.name);
    problem.fix = "correct the axis";
  } else {
    return std::nullopt;
  }
  return problem;
}

void find_lost_range(const CompiledRobot& from, const Instance& state, const CompiledRobot& to,
                     std::vector<Diagnostic>& refused) {
  constexpr double kSlack = 0.01;  // rad or m: a loaded drive sags slightly beyond its target
  for (const ModelJoint& joint : to.model().joints) {
    const int index = from.model().find_joint(joint.name);
    if (index < 0) continue;
    const ModelJoint& old = from.model().joints[static_cast<std::size_t>(index)];
    if (auto lost = lost_motion(old, joint, to)) refused.push_back(std::move(*lost));
    if (!joint.scalar() || joint.mimics()) continue;
    if (!old.scalar() || (old.lower == joint.lower && old.upper == joint.upper)) continue;
    const double q = state.q()[static_cast<std::size_t>(old.q)];
    const bool was_outside = q < old.lower - kSlack || q > old.upper + kSlack;
    const bool is_outside = q < joint.lower - kSlack || q > joint.upper + kSlack;
    // A joint that is already outside may stay there; refused is only what the edit itself would cause.
    const bool lost = joint.upper - joint.lower < 1e-6 && old.upper - old.lower >= 1e-6;
    if (!lost && (was_outside || !is_outside)) continue;
    const Joint* source = to.description().find_joint(joint.name);
    Diagnostic problem;
    problem.rule = "reload.limits";
    problem.where = source->limits ? source->limits->source : source->source;
    problem.message = fmt::format(
        "joint '{}' is at {:.4g} and would have the limits [{:.4g}, {:.4g}] instead of [{:.4g}, {:.4g}]",
        joint.name, q, joint.lower, joint.upper, old.lower, old.upper);
    problem.fix = "correct lower and upper; if they are intended, move the joint inside them first";
    refused.push_back(std::move(problem));
  }
}

}  // namespace

void refuse_lost_range(const CompiledScenario& from, const CompiledScenario& to) {
  std::vector<Diagnostic> refused;
  for (const auto& robot : to.robots) {
    const auto before = from.find(robot->name_space());
    if (before != nullptr) find_lost_range(*before, instance_of(*from.engine, *before), *robot, refused);
  }
  if (!refused.empty()) throw InputError(std::move(refused));
}

namespace {

bool is_robot(const CompiledScenario& machine, const ModelInstance& instance) {
  return std::ranges::any_of(machine.robots,
                             [&](const auto& robot) { return robot->name() == instance.name; });
}

bool in_file(const CompiledScenario& machine, const std::string& object) {
  return std::ranges::find(machine.in_file, object) != machine.in_file.end();
}

// The new instances without objects that were deleted at run time, and with spawned ones.
std::vector<ModelInstance> instances_after(const CompiledScenario& from, const CompiledScenario& to) {
  std::vector<ModelInstance> out;
  const CompiledWorld& there = from.engine->world();
  for (const ModelInstance& instance : to.engine->world().instances()) {
    const bool was_in_file = in_file(from, instance.name);
    if (is_robot(to, instance) || !was_in_file || there.find(instance.name) >= 0) out.push_back(instance);
  }
  for (const ModelInstance& instance : there.instances()) {
    const bool put_in = !is_robot(from, instance) && !in_file(from, instance.name);
    if (put_in && find_instance(out, instance.name) < 0) out.push_back(instance);
  }
  return out;
}

void carry_over_joints(const Instance& from, Instance to) {
  Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(to.q().data(), to.model().nq);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(to.model().nv);
  for (const ModelJoint& joint : to.model().joints) {
    const int index = from.model().find_joint(joint.name);
    if (index < 0) continue;
    const ModelJoint& old = from.model().joints[static_cast<std::size_t>(index)];
    // A joint whose type changed has no former position that would mean the same.
    if (old.nq != joint.nq || old.nv != joint.nv) continue;
    for (int i = 0; i < joint.nq; ++i) q[joint.q + i] = from.q()[static_cast<std::size_t>(old.q + i)];
    for (int i = 0; i < joint.nv; ++i) v[joint.v + i] = from.v()[static_cast<std::size_t>(old.v + i)];
  }
  to.set_state({q.data(), static_cast<std::size_t>(q.size())},
               {v.data(), static_cast<std::size_t>(v.size())});
}

void carry_over_objects(const CompiledScenario& from, CompiledScenario& to) {
  std::vector<ModelInstance> instances = instances_after(from, to);
  const bool as_in_file = std::ranges::equal(instances, to.engine->world().instances(), {},
                                             &ModelInstance::name, &ModelInstance::name);
  if (!as_in_file) to.engine->set_instances(std::move(instances));
  for (std::size_t i = 0; i < to.engine->world().instances().size(); ++i) {
    Instance object = to.engine->instance(static_cast<int>(i));
    const std::optional<Instance> before = from.engine->find(object.name());
    if (is_robot(to, object.made_of()) || !before || is_robot(from, before->made_of())) continue;
    if (!before->made_of().floating()) {
      // An object that was not moved gets its pose from the file, which may have been edited.
      if (before->root_pose().isApprox(before->made_of().X_WR, 1e-9)) continue;
    }
    if (object.model().joints.size() > 1) carry_over_joints(*before, object);
    object.place(before->base_pose());
    object.set_base_velocity(before->base_velocity());
  }
}

}  // namespace

void carry_over_state(const CompiledScenario& from, CompiledScenario& to) {
  to.engine->set_time(from.engine->time());
  carry_over_objects(from, to);
  for (const auto& robot : to.robots) {
    const auto before = from.find(robot->name_space());
    if (before == nullptr) continue;
    Instance state = instance_of(*to.engine, *robot);
    carry_over_joints(instance_of(*from.engine, *before), state);
    state.lift_out_of_ground();  // an edit may have made shapes larger
  }
}

}  // namespace doppel
