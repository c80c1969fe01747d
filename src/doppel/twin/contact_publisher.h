#pragma once
// /gazebo/contacts (gazebo_msgs/msg/ContactsState, 30 Hz of simulated time, only while somebody listens):
// what touches what. A robot's shape is called "robot::link::link_collision", an object's
// "object::link::collision", as Gazebo calls them; the ground is the object "ground". Positions and forces
// are in the frame "world".

#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/messages/gazebo_msgs.h"
#include "doppel/physics/engine.h"
#include "doppel/twin/due.h"

namespace doppel {

class ContactPublisher {
 public:
  // The model outlives it.
  ContactPublisher(Bus& bus, const Model& model);

  // Between steps.
  void publish_due(const Engine& engine, Time now) {
    if (due_(now, topic_.has_listeners())) publish(engine, now);
  }
  void at_once() { due_.at_once(); }

 private:
  void publish(const Engine& engine, Time now);
  [[nodiscard]] std::string shape_name(int link, std::string_view object) const;

  const Model& model_;
  Node node_;
  Publisher<gazebo_msgs::msg::ContactsState> topic_;
  Due due_{Duration{33'333'333}};
  std::vector<Contact> contacts_;
};

}  // namespace doppel
