#pragma once
// /gazebo/contacts (gazebo_msgs/msg/ContactsState, 30 Hz of simulated time, only while there are
// subscribers): the contacts. As in Gazebo, a robot's shape is "robot::link::link_collision" (the robot by
// its namespace if it has one), an object's "object::link::collision"; the ground is the object "ground".
// Positions (m) and forces (N) are in the frame "world".

#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/messages/gazebo_msgs.h"
#include "doppel/twin/publish_schedule.h"
#include "doppel/twin/scene.h"
#include "doppel/twin/tickable.h"

namespace doppel {

class ContactPublisher : public Tickable {
 public:
  // The scene outlives it.
  ContactPublisher(Bus& bus, const Scene& scene);

  void between_steps(Time now) override {
    if (due_(now, topic_.has_listeners())) publish_contacts(now);
  }
  void show(Time /*now*/) override { due_.at_once(); }

 private:
  void publish_contacts(Time now);
  [[nodiscard]] std::string shape_name(BodyId body) const;

  const Scene& scene_;
  Node node_;
  Publisher<gazebo_msgs::msg::ContactsState> topic_;
  PublishSchedule due_{Duration{33'333'333}};
  std::vector<Contact> contacts_;
};

}  // namespace doppel
