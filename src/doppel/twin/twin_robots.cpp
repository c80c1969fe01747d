// Robots that come and go while the twin runs.

#include <fmt/format.h>

#include "doppel/bus/name_rules.h"
#include "doppel/core/thrown.h"
#include "doppel/physics/engine_modules.h"
#include "doppel/twin/detail/entity_mesh.h"
#include "doppel/twin/detail/twin.h"

namespace doppel {
namespace {

constexpr const char* kOrigin = "gazebo";

// Meshes and controllers' files that lie in no package are not read: whoever may call a service must not be
// able to read any file of the machine by it. Throws InputError.
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

std::shared_ptr<Twin::Newcomer> Twin::prepare_robot(const std::shared_ptr<const Running>& running,
                                                    const WorldRobot& robot, const std::string& urdf,
                                                    Diagnostics& diagnostics) const {
  const Impl& twin = *impl_;
  if (const Status fine = check_namespace("/" + robot.name_space); !fine) {
    throw InputError("up.namespace", robot.source,
                     fmt::format("'{}' cannot be a robot's namespace: {}", robot.name_space, fine.why()),
                     "letters, digits and _ make a namespace");
  }
  PackageResolver resolver;
  resolver.add_bundled(twin.scenario.bundled_robots);
  for (const auto& known : running->robots.now) {
    if (!known->from_text()) resolver.add_context(known->setup().target.description);
  }
  RobotDescription description = parse_urdf(urdf, robot.name_space + ".urdf", resolver, diagnostics);
  diagnostics.throw_if_errors();
  keep_to_packages(description, resolver);
  World world;
  static_cast<WorldSettings&>(world) = running->settings;
  CollisionMeshes meshes;
  const auto machine = std::make_shared<RobotMachine>(robot, twin.scenario, world, std::move(description),
                                                      meshes, diagnostics);
  const auto alone =
      compile_world(twin.scenario.engine, world, {machine->instance()}, diagnostics)->make_engine();
  const Instance instance = instance_of(*alone, *machine);
  machine->report_choices(instance, diagnostics);
  const auto start = [&](ControlStack& control, const Log& quiet) {
    if (twin.scenario.start_controllers) control.start(control.wish_of(robot.activate), quiet);
  };
  rehearse(*machine, instance, twin.scenario, twin.controllers, twin.hardware, start, diagnostics);
  auto newcomer = std::make_shared<Newcomer>();
  newcomer->machine = machine;
  return newcomer;
}

void Twin::Impl::add_robot(Newcomer& newcomer) {
  const auto held = hold();
  const RobotMachine& fresh = *newcomer.machine;
  if (find(fresh.name_space()) != nullptr) {
    throw InputError("up.namespace", {}, fmt::format("there is a robot '{}' already", fresh.name_space()),
                     "choose another namespace, or delete it first");
  }
  Engine& engine = *machine->engine;
  engine.spawn(fresh.instance());
  const std::size_t before = robots.size();
  try {
    Diagnostics overlaps, reported_before;
    report_overlaps(fresh, engine, overlaps);
    for (const Diagnostic& one : overlaps.all()) log.warning(kOrigin, one.str());
    robots.push_back(make_robot(newcomer.machine, std::nullopt, reported_before));
    machine->robots.push_back(newcomer.machine);
    renew_handles();
    robots.back()->make_publishers();
    if (scenario.start_controllers) robots.back()->start(robots.back()->first_wish());
    robots.back()->start_loop();
  } catch (...) {
    robots.resize(before);
    machine->robots.resize(before);
    engine.remove(fresh.name());
    renew_handles();
    throw;
  }
  if (robots_changed) robots_changed();
}

Status Twin::Impl::remove_robot(const std::string& name_space) {
  const auto held = hold();
  TwinRobot* const robot = find(name_space);
  if (robot == nullptr) return Status::refused(fmt::format("there is no robot '{}'", name_space));
  if (name_space.empty() || robots.size() == 1)
    return Status::refused(fmt::format("'{}' is {}, which stays as long as the twin runs", robot->name(),
                                       robots.size() == 1 ? "the robot" : "the robot without a namespace"));
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

void Twin::Impl::spawn_robot(WorldRobot robot, std::string urdf, std::function<void(const Status&)> done) {
  if (building)
    return done(Status::refused("another robot is being made ready; call again when it is in the world"));
  if (builder.joinable()) builder.join();
  building = true;
  builder = std::thread(
      [this, now = twin.running(), robot = std::move(robot), urdf = std::move(urdf), done = std::move(done)] {
        std::shared_ptr<Newcomer> newcomer;
        auto said = std::make_shared<Diagnostics>();
        std::string why;
        try {
          newcomer = twin.prepare_robot(now, robot, urdf, *said);
        } catch (...) {
          why = thrown_text();
        }
        bus.post([this, newcomer, said, why, done]() mutable {
          building = false;
          if (newcomer != nullptr) {
            try {
              add_robot(*newcomer);
              for (const Diagnostic& one : said->all()) log.line(one.severity, kOrigin, one.str());
            } catch (...) {
              why = thrown_text();
            }
          }
          done(why.empty() ? Status() : Status::refused(why));
        });
      });
}

void Twin::add_robot(const std::shared_ptr<Newcomer>& newcomer) {
  impl_->add_robot(*newcomer);
}

void Twin::on_robots_changed(std::function<void()> callback) {
  impl_->robots_changed = std::move(callback);
}

Status Twin::remove_robot(const std::string& name_space) {
  return impl_->remove_robot(name_space);
}

}  // namespace doppel
