#pragma once
// Robots and objects as Gazebo's entities: /spawn_entity, /delete_entity, /gazebo/get_entity_state and
// set_entity_state, and ROS 1's get_model_state and set_model_state. Everything runs on the loop's thread,
// between steps; spawning or deleting an object, and deleting a robot, costs a recompilation of the physics'
// model. A spawned robot is prepared on a separate thread, and its call gets its response when the robot is
// in the world.
//
// Names of entities and frames of reference: entity.h. A reset returns objects to their initial poses and
// removes none. Velocities relative to a frame are in the frame's axes, as in gazebo_ros: a read velocity is
// relative to that of the frame, a written one is not.

#include <functional>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/physics/contract/world_robot.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/twin/entities/entity.h"
#include "doppel/twin/loop/tickable.h"
#include "doppel/twin/loop/twin_core.h"
#include "doppel/twin/services/detail/entity_xml.h"
#include "doppel/twin/spawn/robot_spawner.h"

namespace doppel {

inline constexpr std::size_t kMaxObjects = 200;

class EntityServices : public Tickable {
 public:
  // A refusal is logged if the response has no field for it.
  explicit EntityServices(TwinCore& core);

  // -- for the services of gz-sim (world_services.h)
  struct Spawned {
    std::string name, xml, name_space;  // name: empty: that in the xml
    Pose X_WE = Pose::Identity();
    bool rename = false;  // another name where the name is taken, as Gazebo makes it: "box_0"
  };
  // `done` gets the reason of a refusal, or what is in the world now; later for a robot.
  using SpawnDone = std::function<void(const Status&, const std::string& good)>;
  void spawn(Spawned what, const SpawnDone& done);
  // A copy of an object, in the initial configuration of the original.
  void clone(const std::string& original, const Spawned& what, const SpawnDone& done);
  Status remove(const std::string& name);
  Status set_pose(const std::string& name, const geometry_msgs::msg::Pose& pose);
  [[nodiscard]] Status place_in(const std::string& frame, const geometry_msgs::msg::Pose& pose,
                                Pose& X_WE) const;
  void log_refusal(const std::string& service, const Status& status);

 private:
  void advertise_spawning();
  void offer_entity_state();
  void offer_model_state();

  void spawn_entity(const Spawned& what, const SpawnDone& done);
  void spawn_urdf(const Spawned& what, const std::string& robot, const SpawnDone& done);
  void spawn_robot(WorldRobot robot, SpawnedText text, std::vector<ModelInstance> others,
                   const SpawnDone& done);
  void add_objects(std::vector<ModelInstance> objects);
  Status add_parts(const std::string& robot, const std::vector<ModelInstance>& parts);
  Status remove_driven_parts(const std::string& model);
  [[nodiscard]] std::string free_name(const std::string& name, bool rename) const;
  [[nodiscard]] Status check_name(const std::string& name) const;
  void move(const Entity& entity, EntityMotion motion);
  Status get_state(const std::string& name, const std::string& frame, geometry_msgs::msg::Pose& pose,
                   geometry_msgs::msg::Twist& twist) const;
  Status set_state(const std::string& name, const std::string& frame, const geometry_msgs::msg::Pose& pose,
                   const geometry_msgs::msg::Twist& twist);

  [[nodiscard]] std::vector<std::string> namespaces() const;  // of the robots
  Status remove_robot(int instance);

  TwinCore& core_;
  const Scene& scene_ = core_.scene();
  const Log& log_ = core_.log();
  RobotSpawner spawner_{core_};
  Node node_;
  std::string last_error_;  // the refusal that was logged last
};

}  // namespace doppel
