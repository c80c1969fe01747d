#include "doppel/twin/spawn/robot_spawner.h"

#include <fmt/format.h>

#include <mutex>
#include <utility>

#include "doppel/base/core/thrown.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/twin/spawn/entity_mesh.h"

namespace doppel {
namespace {

constexpr const char* kSpawnLogOrigin = "gazebo";
constexpr int kMaxBuilds = 3;      // of one robot, repeated when other robots are added or removed meanwhile
constexpr int kMaxUnfinished = 2;  // builds at once; more would take the processors from the loop
constexpr std::chrono::seconds kSpawnDeadline{10};
constexpr std::chrono::seconds kBuildEndTime{1};  // in which a build may end when the twin does

// Meshes and controllers' files outside of packages are not read, so that a client cannot read arbitrary
// files of the machine by a service. Throws InputError.
void keep_to_packages(RobotDescription& robot, const PackageResolver& resolver) {
  const auto check = [&](Geometry& geometry) {
    auto* mesh = std::get_if<MeshGeometry>(&geometry);
    if (mesh == nullptr || mesh->path.empty()) return;
    Target target;
    target.package_folder = package_above(mesh->path);
    mesh->path = find_entity_mesh(mesh->uri, resolver, target).string();
  };
  for (Link& link : robot.links) {
    for (Visual& visual : link.visuals) check(visual.geometry);
    for (Collision& collision : link.collisions) check(collision.geometry);
  }
  for (GazeboExtension& extension : robot.gazebo) {
    for (GazeboPlugin& plugin : extension.plugins)
      std::erase_if(plugin.parameter_files,
                    [](const std::string& file) { return package_above(file).empty(); });
  }
}

}  // namespace

std::shared_ptr<JoiningRobot> prepare_robot(const RunningMachine& running, const WorldRobot& robot,
                                            const SpawnedText& text, Diagnostics& diagnostics) {
  const TwinSources& sources = *running.sources;
  if (const Status fine = check_namespace("/" + robot.name_space); !fine) {
    throw InputError(
        "up.namespace", robot.source,
        fmt::format("'{}' is not a valid namespace of a robot: {}", robot.name_space, fine.why()),
        "use letters, digits and _ in a namespace");
  }
  for (const auto& other : running.robots.now) {
    if (other->name_space() == robot.name_space) refuse_taken(robot.name_space);
  }
  PackageResolver resolver;
  resolver.add_bundled(sources.scenario.bundled_robots);
  for (const auto& other : running.robots.now) {
    if (!other->asked().target.empty()) resolver.add_context(other->setup().target.description);
  }
  World world;
  static_cast<WorldSettings&>(world) = running.world->settings();
  CollisionMeshes meshes;
  std::shared_ptr<CompiledRobot> machine;
  if (const auto* const model = std::get_if<SdfModel>(&text)) {
    machine = std::make_shared<CompiledRobot>(robot, sources.scenario, world, *model, model->name, meshes,
                                              diagnostics);
  } else {
    RobotDescription description =
        parse_urdf(std::get<std::string>(text), robot.name_space + ".urdf", resolver, diagnostics);
    diagnostics.throw_if_errors();
    keep_to_packages(description, resolver);
    machine = std::make_shared<CompiledRobot>(robot, sources.scenario, world, std::move(description), meshes,
                                              diagnostics);
  }
  const auto alone = compile_world(sources.scenario.engine, static_cast<const WorldSettings&>(world),
                                   {machine->instance()}, diagnostics)
                         ->make_engine();
  const Instance instance = instance_of(*alone, *machine);
  machine->report_choices(instance, diagnostics);
  const auto start = [&](ControlStack& control, const Log& quiet) {
    if (sources.scenario.start_controllers) control.start(control.selection_of(*machine), quiet);
  };
  rehearse(*machine, instance, sources, start, diagnostics);
  auto joining = std::make_shared<JoiningRobot>();
  joining->machine = machine;
  joining->compile_into(running.world);
  return joining;
}

// A robot that is being spawned.
struct RobotSpawner::Spawning {
  WorldRobot robot;
  SpawnedText text;
  std::function<void(const Status&)> done;
  std::shared_ptr<const RunningMachine> running;  // at the call
  std::shared_ptr<const CompiledWorld> world;     // to which it is added
  std::shared_ptr<JoiningRobot> joining;
  Diagnostics notes;
  std::string why;  // the reason if it cannot be spawned
  int number = 0, builds = 0;
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
};

// The only access of a build's thread to the spawner, because the thread may outlive it.
struct RobotSpawner::BuildResults {
  std::mutex mutex;
  RobotSpawner* spawner = nullptr;  // nullptr: there is none any more
};

RobotSpawner::RobotSpawner(TwinCore& core) : RobotSpawner(core, kSpawnDeadline) {}

RobotSpawner::RobotSpawner(TwinCore& core, std::chrono::milliseconds deadline)
    : core_(core), deadline_(deadline), build_results_(std::make_shared<BuildResults>()) {
  build_results_->spawner = this;
}

RobotSpawner::~RobotSpawner() {
  {
    const std::lock_guard lock(build_results_->mutex);
    build_results_->spawner = nullptr;
  }
  static_cast<void>(builds_.wait_for(kBuildEndTime));
}

void RobotSpawner::spawn(WorldRobot robot, SpawnedText text, Done done) {
  if (spawning_ != nullptr && std::chrono::steady_clock::now() - spawning_->begin < deadline_)
    return done(Status::refused("another robot is being spawned; call again when it is in the world"));
  if (builds_.unfinished() >= kMaxUnfinished) {
    return done(Status::refused(fmt::format(
        "{} earlier robots are still being built; restart doppel to spawn another one", kMaxUnfinished)));
  }
  if (spawning_ != nullptr) abandon_build();
  auto fresh = std::make_shared<Spawning>();
  fresh->robot = std::move(robot);
  fresh->text = std::move(text);
  fresh->done = std::move(done);
  fresh->running = core_.running();
  fresh->number = ++jobs_;
  build(fresh);
  spawning_ = std::move(fresh);
}

// On a separate thread; then settle() on the loop's thread.
void RobotSpawner::build(const std::shared_ptr<Spawning>& job) {
  ++job->builds;
  const auto work = [job] {
    try {
      if (job->joining == nullptr) {
        job->joining = prepare_robot(*job->running, job->robot, job->text, job->notes);
      } else {
        job->joining->compile_into(job->world);
      }
    } catch (...) {
      job->why = thrown_text();
    }
  };
  const auto pass_to_loop = [results = build_results_, job] {
    const std::lock_guard lock(results->mutex);
    if (results->spawner == nullptr) return;
    results->spawner->core_.bus().complete(fmt::format("spawn {}.{}", job->number, job->builds),
                                           [spawner = results->spawner, job] { spawner->settle(job); });
  };
  builds_.start(work, pass_to_loop, [results = build_results_](const std::string& why) {
    const std::lock_guard lock(results->mutex);
    if (results->spawner == nullptr) return;
    results->spawner->core_.log().error(
        kSpawnLogOrigin, "a spawned robot is ready, but could not be passed to the loop: " + why);
  });
}

void RobotSpawner::settle(const std::shared_ptr<Spawning>& job) {
  if (job != spawning_) return;  // it was abandoned
  try {
    if (job->why.empty()) {
      job->world = core_.engine().compiled();
      if (job->joining->without != job->world && job->builds < kMaxBuilds) return build(job);
      core_.add_robot(*job->joining);
      for (const Diagnostic& one : job->notes.all())
        core_.log().line(one.severity, kSpawnLogOrigin, one.str());
    }
  } catch (...) {
    job->why = thrown_text();
  }
  spawning_ = nullptr;
  answer(*job, job->why.empty() ? Status() : Status::refused(job->why));
}

void RobotSpawner::answer(const Spawning& job, const Status& status) {
  try {
    job.done(status);
  } catch (...) {
    core_.log().error(kSpawnLogOrigin, fmt::format("the answer to the spawning of '{}' failed: {}",
                                                   job.robot.name_space, thrown_text()));
  }
}

// The result of the build is dropped.
void RobotSpawner::abandon_build() {
  const auto abandoned = std::exchange(spawning_, nullptr);
  builds_.abandon();
  answer(*abandoned, Status::refused(fmt::format(
                         "the robot took longer than {:g} s to build, and another one is spawned instead",
                         std::chrono::duration<double>(deadline_).count())));
}

}  // namespace doppel
