#pragma once
// The services of gz-sim below /world/NAME, as ros_gz_bridge offers them (ros_gz_interfaces): create, remove, set_pose
// and control. They do what /spawn_entity, /delete_entity, /gazebo/set_entity_state and the services of time do; a
// refusal is logged, because the responses have no field for its reason. On the loop's thread, between steps.

#include <string>

#include "doppel/base/core/log.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "doppel/twin/services/detail/entity_services.h"
#include "doppel/twin/services/detail/simulator_services.h"

namespace doppel {

class WorldServices : public Tickable {
 public:
  // The others outlive it.
  WorldServices(TwinCore& core, EntityServices& entities, SimulatorServices& simulator);

 private:
  using Control = ros_gz_interfaces::msg::WorldControl;
  void create(const ros_gz_interfaces::msg::EntityFactory& factory, const EntityServices::SpawnDone& done);
  [[nodiscard]] static Status name_of(const ros_gz_interfaces::msg::Entity& entity, std::string& name);
  [[nodiscard]] Status control(const Control& wanted);

  TwinCore& core_;
  EntityServices& entities_;
  SimulatorServices& simulator_;
  Node node_;
  bool seed_logged_ = false;
};

}  // namespace doppel
