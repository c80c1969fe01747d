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

#include "doppel/bus/bus.h"
#include "doppel/core/log.h"
#include "doppel/messages/gazebo_msgs.h"
#include "doppel/physics/world_robot.h"
#include "doppel/twin/detail/entity.h"
#include "doppel/twin/detail/entity_xml.h"
#include "doppel/twin/tickable.h"

namespace doppel {

inline constexpr std::size_t kMaxObjects = 200;

class EntityServices : public Tickable {
 public:
  struct Callbacks {
    MeshFinder find_mesh;
    std::function<void()> changed;  // instances were added, removed or moved
    // Brings up a robot of URDF text under its namespace at its pose; `done` is called later, on
    // the loop's thread.
    using Done = std::function<void(const Status&)>;
    std::function<void(WorldRobot robot, std::string urdf, Done done)> spawn_robot;
    std::function<Status(int instance)> remove_robot;
  };
  // Scene and log outlive the services. A refusal is logged if the response has no field for it.
  EntityServices(Bus& bus, const Scene& scene, const Log& log, Callbacks callbacks);

 private:
  void offer_coming_and_going();
  void offer_entity_state();
  void offer_model_state();

  using Spawn = gazebo_msgs::srv::SpawnEntity;
  void spawn(const Spawn::Request& request, const Responder<Spawn::Response>& respond);
  [[nodiscard]] Status place_of(const Spawn::Request& request, Pose& X_WE) const;
  Status spawn_object(const Spawn::Request& request, const Pose& X_WE, std::string& good);
  [[nodiscard]] Status check_name(const std::string& name) const;
  Status remove(const std::string& name);
  void move(const Entity& entity, EntityMotion motion);
  Status get_state(const std::string& name, const std::string& frame, geometry_msgs::msg::Pose& pose,
                   geometry_msgs::msg::Twist& twist) const;
  Status set_state(const std::string& name, const std::string& frame, const geometry_msgs::msg::Pose& pose,
                   const geometry_msgs::msg::Twist& twist);
  void tell_refusal(const char* service, const Status& status);

  const Scene& scene_;
  const Log& log_;
  Callbacks callbacks_;
  Node node_;
  std::string last_error_;  // the refusal that was logged last
};

}  // namespace doppel
