#pragma once
// /gazebo/contacts (gazebo_msgs/msg/ContactsState, 30 Hz of simulated time, only while there are
// subscribers): the contacts. As in Gazebo, a robot's shape is "robot::link::link_collision" (the robot by
// its namespace if it has one), an object's "object::link::collision"; the ground is the object "ground".
// Positions (m) and forces (N) are in the frame "world".

#include <memory>
#include <string>
#include <vector>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/twin/loop/publish_schedule.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/tickable.h"

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
  void name_shapes();
  [[nodiscard]] const std::string& name_of(BodyId body) const;
  gazebo_msgs::msg::ContactState& state_of(BodyId a, BodyId b);

  const Scene& scene_;
  Node node_;
  Publisher<gazebo_msgs::msg::ContactsState> topic_;
  PublishSchedule due_{Duration{33'333'333}};
  std::vector<Contact> contacts_;
  // Names are formed once, and messages keep their memory: robots on wheels touch the ground in every one.
  std::shared_ptr<const CompiledWorld> named_;   // the world of names_
  std::vector<std::vector<std::string>> names_;  // [instances][links]
  std::string ground_ = "ground::link::collision";
  gazebo_msgs::msg::ContactsState message_;
  std::vector<gazebo_msgs::msg::ContactState> spare_;  // not in the message
};

}  // namespace doppel
