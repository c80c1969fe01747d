#include "doppel/twin/services/detail/world_services.h"

#include <fmt/format.h>

#include "doppel/base/core/thrown.h"
#include "doppel/description/gazebo/plugin_values.h"
#include "doppel/twin/spawn/entity_mesh.h"

namespace doppel {

WorldServices::WorldServices(TwinCore& core, EntityServices& entities, SimulatorServices& simulator)
    : core_(core), entities_(entities), simulator_(simulator), node_(core.bus(), "/gazebo") {
  namespace srv = ros_gz_interfaces::srv;
  const std::string below = valid_topic("/world/" + core.engine().world().settings().name) + "/";
  const auto report = [this](const std::string& service, const Status& status) {
    entities_.log_refusal(service, status);
    return status.ok();
  };
  node_.serve<srv::SpawnEntity>(below + "create", [this, report, name = below + "create"](
                                                      const srv::SpawnEntity::Request& r,
                                                      const Responder<srv::SpawnEntity::Response>& respond) {
    create(r.entity_factory, [report, respond, name](const Status& status, const std::string& /*good*/) {
      respond({report(name, status)});
    });
  });
  node_.serve<srv::DeleteEntity>(
      below + "remove",
      [this, report, name = below + "remove"](const srv::DeleteEntity::Request& r,
                                              const Responder<srv::DeleteEntity::Response>& respond) {
        std::string entity;
        Status status = name_of(r.entity, entity);
        if (status) status = entities_.remove(entity);
        respond({report(name, status)});
      });
  node_.serve<srv::SetEntityPose>(
      below + "set_pose",
      [this, report, name = below + "set_pose"](const srv::SetEntityPose::Request& r,
                                                const Responder<srv::SetEntityPose::Response>& respond) {
        std::string entity;
        Status status = name_of(r.entity, entity);
        if (status) status = entities_.set_pose(entity, r.pose);
        respond({report(name, status)});
      });
  node_.serve<srv::ControlWorld>(
      below + "control",
      [this, report, name = below + "control"](const srv::ControlWorld::Request& r,
                                               const Responder<srv::ControlWorld::Response>& respond) {
        respond({report(name, control(r.world_control))});
      });
}

void WorldServices::create(const ros_gz_interfaces::msg::EntityFactory& factory,
                           const EntityServices::SpawnDone& done) {
  EntityServices::Spawned what{factory.name, factory.sdf, ""};
  what.rename = factory.allow_renaming;
  const Status placed = entities_.place_in(factory.relative_to, factory.pose, what.X_WE);
  if (!placed) return done(placed, "");
  const int sources = static_cast<int>(!factory.sdf.empty()) +
                      static_cast<int>(!factory.sdf_filename.empty()) +
                      static_cast<int>(!factory.clone_name.empty());
  if (sources != 1) return done(Status::refused("write one of sdf, sdf_filename and clone_name"), "");
  if (!factory.clone_name.empty()) return entities_.clone(factory.clone_name, what, done);
  try {
    if (!factory.sdf_filename.empty()) what.xml = read_entity_file(factory.sdf_filename);
  } catch (const InputError&) {
    return done(Status::refused(thrown_text()), "");
  }
  entities_.spawn(std::move(what), done);
}

Status WorldServices::name_of(const ros_gz_interfaces::msg::Entity& entity, std::string& name) {
  using ros_gz_interfaces::msg::Entity;
  if (entity.name.empty())
    return Status::refused(
        "the entity has no name; entities are found by their names here, not by their ids");
  if (entity.type != Entity::NONE && entity.type != Entity::MODEL)
    return Status::refused(fmt::format("'{}' is asked for as type {}; only models (2) can be changed",
                                       entity.name.substr(0, kMaxNameLength), entity.type));
  name = entity.name;
  return {};
}

// The order of gz-sim, whose steps of a paused world follow its reset; a time to run to applies to what
// follows.
Status WorldServices::control(const Control& wanted) {
  if (wanted.reset.time_only) {
    return Status::refused(
        "reset.time_only is not offered, because controllers' stamps would lie in the future; use reset.all "
        "or "
        "reset.model_only");
  }
  const Time until = from_msg(wanted.run_to_sim_time);
  const std::uint32_t steps = wanted.multi_step > 0 ? wanted.multi_step : wanted.step ? 1 : 0;
  if (steps > 0 && !wanted.pause)
    return Status::refused("steps are taken by a paused world: write pause: true with step or multi_step");
  if (until > Time{} && until <= core_.now() && !wanted.reset.all)
    return Status::refused(fmt::format("run_to_sim_time is {:g} s, and it is {:g} s already",
                                       to_seconds(until), to_seconds(core_.now())));
  // First, because a world whose physics has diverged takes no steps before it is reset.
  if (wanted.reset.all) {
    core_.reset();
  } else if (wanted.reset.model_only) {
    core_.reset(core_.now());
  }
  if (wanted.pause) {
    simulator_.pause();
  } else if (Status resumed = simulator_.resume(); !resumed) {
    return resumed;
  }
  if (steps > 0) {
    if (Status owed = simulator_.step(steps); !owed) return owed;
  }
  if (until > Time{}) simulator_.pause_at(until);
  if (wanted.seed != 0 && !seed_logged_) {
    seed_logged_ = true;
    core_.log().note(
        "gazebo",
        "the seed of /world/NAME/control has no effect: the physics has no random numbers, and those "
        "of sensors "
        "follow from the seed at the start (doppel up --seed N)");
  }
  return {};
}

}  // namespace doppel
