#pragma once
// The world's objects as Gazebo's entities: /spawn_entity, /delete_entity, /gazebo/get_entity_state and
// set_entity_state, and ROS 1's get_model_state and set_model_state. Everything runs on the loop's thread,
// between steps; an object that comes or goes costs it a recompilation of the physics' model.
//
// Entities and frames of reference are named as entity.h says. A reset puts objects back to where they were
// put, and removes none. Velocities relative to a frame are as gazebo_ros has them, in the frame's axes: what
// is told is the difference to the frame's own, what is set is without it.

#include <functional>
#include <string>

#include "doppel/bus/bus.h"
#include "doppel/core/log.h"
#include "doppel/messages/gazebo_msgs.h"
#include "doppel/physics/engine.h"
#include "doppel/twin/entity.h"
#include "doppel/twin/entity_xml.h"

namespace doppel {

inline constexpr std::size_t kMostObjects = 200;

class EntityServices {
 public:
  struct Callbacks {
    MeshFinder find_mesh;
    std::function<void()> changed;  // an object came, went or was moved
  };
  // `log` outlives it: a refusal that an answer has no field for is told there.
  EntityServices(Bus& bus, const Model& model, Engine& engine, const Log& log, Callbacks callbacks);

  // Another engine for a model with the same links and joints takes over.
  void rebind(Engine& engine) { engine_ = &engine; }

 private:
  void offer_coming_and_going();
  void offer_entity_state();
  void offer_model_state();

  Status spawn(const gazebo_msgs::srv::SpawnEntity::Request& request, std::string& good);
  [[nodiscard]] Status check_name(const std::string& name) const;
  Status remove(const std::string& name);
  void place(const Entity& entity, EntityMotion motion);
  Status get_state(const std::string& name, const std::string& frame, geometry_msgs::msg::Pose& pose,
                   geometry_msgs::msg::Twist& twist) const;
  Status set_state(const std::string& name, const std::string& frame, const geometry_msgs::msg::Pose& pose,
                   const geometry_msgs::msg::Twist& twist);
  void tell_refusal(const char* service, const Status& status);

  const Model& model_;
  Engine* engine_;
  const Log& log_;
  Callbacks callbacks_;
  Node node_;
  std::string told_;  // the refusal that was logged last
};

}  // namespace doppel
