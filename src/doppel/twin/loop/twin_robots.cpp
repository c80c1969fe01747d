// Robots that are spawned and deleted while the twin runs.

#include <fmt/format.h>

#include <atomic>
#include <utility>

#include "doppel/base/core/abandoned_thread.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/thrown.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/twin/loop/detail/entity_mesh.h"
#include "doppel/twin/loop/detail/entity_services.h"
#include "doppel/twin/loop/detail/twin.h"

namespace doppel {
namespace {

constexpr const char* kSpawnLogOrigin = "gazebo";
constexpr int kMaxBuilds = 3;      // of one robot, repeated when other robots are added or removed meanwhile
constexpr int kMaxUnfinished = 2;  // builds at once; more would take the processors from the loop
constexpr std::chrono::seconds kSpawnDeadline{10};  // after it another robot may be spawned instead
constexpr std::chrono::seconds kBuildEndTime{1};    // in which a build may end when the twin does

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

void refuse_taken(const std::string& name_space) {
  throw InputError("up.namespace", {}, fmt::format("there is already a robot '{}'", name_space),
                   "choose another namespace, or delete it first");
}

}  // namespace

std::shared_ptr<Twin::JoiningRobot> Twin::prepare_robot(const std::shared_ptr<const Running>& running,
                                                        const WorldRobot& robot, const SpawnedText& text,
                                                        Diagnostics& diagnostics) {
  const TwinSources& from = *running->sources;
  if (const Status fine = check_namespace("/" + robot.name_space); !fine) {
    throw InputError(
        "up.namespace", robot.source,
        fmt::format("'{}' is not a valid namespace of a robot: {}", robot.name_space, fine.why()),
        "use letters, digits and _ in a namespace");
  }
  for (const auto& known : running->robots.now) {
    if (known->name_space() == robot.name_space) refuse_taken(robot.name_space);
  }
  PackageResolver resolver;
  resolver.add_bundled(from.scenario.bundled_robots);
  for (const auto& known : running->robots.now) {
    if (!known->asked().target.empty()) resolver.add_context(known->setup().target.description);
  }
  World world;
  static_cast<WorldSettings&>(world) = running->world->settings();
  CollisionMeshes meshes;
  std::shared_ptr<CompiledRobot> machine;
  if (const auto* const model = std::get_if<SdfModel>(&text)) {
    machine = std::make_shared<CompiledRobot>(robot, from.scenario, world, *model, model->name, meshes,
                                              diagnostics);
  } else {
    RobotDescription description =
        parse_urdf(std::get<std::string>(text), robot.name_space + ".urdf", resolver, diagnostics);
    diagnostics.throw_if_errors();
    keep_to_packages(description, resolver);
    machine = std::make_shared<CompiledRobot>(robot, from.scenario, world, std::move(description), meshes,
                                              diagnostics);
  }
  const auto alone = compile_world(from.scenario.engine, static_cast<const WorldSettings&>(world),
                                   {machine->instance()}, diagnostics)
                         ->make_engine();
  const Instance instance = instance_of(*alone, *machine);
  machine->report_choices(instance, diagnostics);
  const auto start = [&](ControlStack& control, const Log& quiet) {
    if (from.scenario.start_controllers) control.start(control.selection_of(robot.activate), quiet);
  };
  rehearse(*machine, instance, from.scenario, from.controllers, from.hardware, start, diagnostics);
  auto joining = std::make_shared<JoiningRobot>();
  joining->machine = machine;
  joining->compile_into(running->world);
  return joining;
}

void Twin::JoiningRobot::compile_into(std::shared_ptr<const CompiledWorld> world) {
  std::vector<ModelInstance> instances = world->instances();
  instances.push_back(machine->instance());
  Diagnostics reported_before;
  with = world->with(std::move(instances), reported_before);
  without = std::move(world);
}

void Twin::Impl::add_robot(JoiningRobot& joining) {
  const auto held = hold();
  const CompiledRobot& fresh = *joining.machine;
  if (find(fresh.name_space()) != nullptr) refuse_taken(fresh.name_space());
  Engine& engine = *machine->engine;
  if (joining.without != engine.compiled()) joining.compile_into(engine.compiled());
  engine.continue_with(joining.with);
  const std::size_t before = robots.size();
  try {
    if (const std::string why = spawned_divergence(engine); !why.empty())
      throw InputError("up.diverges", fresh.description().source,
                       fmt::format("with the robot '{}' {}", fresh.name(), why),
                       "place it where it touches nothing, and check its masses and inertias");
    Diagnostics overlaps, reported_before;
    report_overlaps(fresh, engine, overlaps);
    for (const Diagnostic& one : overlaps.all()) log.warning(kSpawnLogOrigin, one.str());
    robots.push_back(make_robot(joining.machine, nullptr, reported_before));
    machine->robots.push_back(joining.machine);
    renew_handles();
    robots.back()->make_publishers();
    if (scenario.start_controllers) robots.back()->start(robots.back()->first_selection());
    robots.back()->start_loop();
  } catch (...) {
    robots.resize(before);
    machine->robots.resize(before);
    engine.continue_with(joining.without);
    renew_handles();
    throw;
  }
  if (robots_changed) robots_changed();
}

Status Twin::Impl::remove_robot(const std::string& name_space) {
  const auto held = hold();
  TwinRobot* const robot = find(name_space);
  if (robot == nullptr) return Status::refused(fmt::format("there is no robot '{}'", name_space));
  if (name_space.empty() && !robot->machine().setup().from_plugins) {
    return Status::refused(fmt::format(
        "'{}' is the robot without a namespace, so its nodes and topics are those of the twin itself, "
        "and it cannot be deleted; a robot that is started in a namespace can be: doppel up --robot "
        "TARGET:NAMESPACE",
        robot->name()));
  }
  const std::string name = robot->name();
  gone_hash = mixed(gone_hash, robot->state_hash());
  std::erase_if(machine->robots, [&](const auto& r) { return r->name_space() == name_space; });
  std::erase_if(robots, [&](const auto& r) { return r->name_space() == name_space; });
  machine->engine->remove(name);
  renew_handles();
  for (const auto& other : robots) other->robots_changed(machine->engine->time());
  if (robots_changed) robots_changed();
  return {};
}

// A robot that is being spawned.
struct Twin::Impl::Spawning {
  WorldRobot robot;
  SpawnedText text;
  std::function<void(const Status&)> done;
  std::shared_ptr<const Running> running;      // at the call
  std::shared_ptr<const CompiledWorld> world;  // to which it is added
  std::shared_ptr<JoiningRobot> joining;
  Diagnostics notes;
  std::string why;  // the reason if it cannot be spawned
  int builds = 0;
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  std::atomic<bool> is_built{false};
};

// The only access of a build's thread to the twin, because the thread may outlive it.
struct Twin::Impl::BuildResults {
  std::mutex mutex;
  Impl* twin = nullptr;  // nullptr: there is no twin any more
};

std::shared_ptr<Twin::Impl::BuildResults> Twin::Impl::make_build_results() {
  auto results = std::make_shared<BuildResults>();
  results->twin = this;
  return results;
}

void Twin::Impl::spawn_robot(WorldRobot robot, SpawnedText text, std::function<void(const Status&)> done) {
  if (spawning != nullptr && std::chrono::steady_clock::now() - spawning->begin < kSpawnDeadline)
    return done(Status::refused("another robot is being spawned; call again when it is in the world"));
  if (*unfinished_builds >= kMaxUnfinished) {
    return done(Status::refused(fmt::format(
        "{} earlier robots are still being built; restart doppel to spawn another one", kMaxUnfinished)));
  }
  if (spawning != nullptr) abandon_build();
  auto fresh = std::make_shared<Spawning>();
  fresh->robot = std::move(robot);
  fresh->text = std::move(text);
  fresh->done = std::move(done);
  fresh->running = twin.running();
  build(fresh);
  spawning = std::move(fresh);
}

// On a separate thread; then settle() on the loop's thread.
void Twin::Impl::build(const std::shared_ptr<Spawning>& job) {
  if (builder.joinable()) builder.join();
  ++job->builds;
  job->is_built = false;
  const auto work = [results = build_results, unfinished = unfinished_builds, job] {
    try {
      if (job->joining == nullptr) {
        job->joining = Twin::prepare_robot(job->running, job->robot, job->text, job->notes);
      } else {
        job->joining->compile_into(job->world);
      }
    } catch (...) {
      job->why = thrown_text();
    }
    --*unfinished;
    job->is_built = true;
    const std::lock_guard lock(results->mutex);
    if (results->twin == nullptr) return;
    results->twin->bus.post([twin = results->twin, job] { twin->settle(job); });
  };
  builder = guarded_thread(work, [results = build_results](const std::string& why) {
    const std::lock_guard lock(results->mutex);
    if (results->twin == nullptr) return;
    results->twin->log.error(kSpawnLogOrigin,
                             "a spawned robot is ready, but could not be passed to the loop: " + why);
  });
  ++*unfinished_builds;
}

void Twin::Impl::settle(const std::shared_ptr<Spawning>& job) {
  if (job != spawning) return;  // it was abandoned
  try {
    if (job->why.empty()) {
      job->world = machine->engine->compiled();
      if (job->joining->without != job->world && job->builds < kMaxBuilds) return build(job);
      add_robot(*job->joining);
      for (const Diagnostic& one : job->notes.all()) log.line(one.severity, kSpawnLogOrigin, one.str());
    }
  } catch (...) {
    job->why = thrown_text();
  }
  spawning = nullptr;
  answer(*job, job->why.empty() ? Status() : Status::refused(job->why));
}

void Twin::Impl::answer(const Spawning& job, const Status& status) {
  try {
    job.done(status);
  } catch (...) {
    log.error(kSpawnLogOrigin, fmt::format("the answer to the spawning of '{}' failed: {}",
                                           job.robot.name_space, thrown_text()));
  }
}

// The thread continues, if it ever does, with what it has, and its result is dropped.
void Twin::Impl::abandon_build() {
  const auto abandoned = std::exchange(spawning, nullptr);
  if (abandoned->is_built) {
    builder.join();
  } else {
    mark_thread_abandoned();
    builder.detach();
  }
  answer(*abandoned, Status::refused(fmt::format(
                         "the robot took longer than {} s to build, and another one is spawned instead",
                         kSpawnDeadline.count())));
}

void Twin::Impl::end_build() {
  {
    const std::lock_guard lock(build_results->mutex);
    build_results->twin = nullptr;
  }
  if (!builder.joinable()) return;
  const auto end = std::chrono::steady_clock::now() + kBuildEndTime;
  while (spawning != nullptr && !spawning->is_built && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  if (spawning == nullptr || spawning->is_built) return builder.join();
  mark_thread_abandoned();
  builder.detach();
}

void Twin::add_robot(const std::shared_ptr<JoiningRobot>& joining) {
  impl_->add_robot(*joining);
}

void Twin::on_robots_changed(std::function<void()> callback) {
  impl_->robots_changed = std::move(callback);
}

Status Twin::remove_robot(const std::string& name_space) {
  return impl_->remove_robot(name_space);
}

}  // namespace doppel
