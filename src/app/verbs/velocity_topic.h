#pragma once
// The topic that drives a base: found by its type among those with subscribers, and published on with stamps.

#include <optional>
#include <string>

#include "app/verbs/shell.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/network/node.h"

namespace doppel::app {

struct VelocityTopic {
  std::string name;     // "/base_controller/cmd_vel"
  bool stamped = true;  // TwistStamped, else Twist
};

// `asked`: the user's choice, or empty for the one that a node reads: in the robot's namespace (--ns), and of
// several the one named cmd_vel. `stamped`: the user's choice of the type. Waits up to two seconds for one.
// Throws ClientError if there is none, or several.
VelocityTopic find_velocity_topic(Client& twin, const std::string& asked, std::optional<bool> stamped);

// Publishes as a node of this program on the network, or over the connection to a twin.
class VelocityPublisher {
 public:
  // node: that of this program; nullptr: over the connection.
  VelocityPublisher(Client& twin, VelocityTopic topic, ros2::Node* node);
  void set_frame(std::string frame) { frame_ = std::move(frame); }  // in the header of TwistStamped
  // Takes received messages; those of topics other than /clock are given to `other`.
  using Other = std::function<void(const Client::Received&)>;
  void receive(const Other& other = {});
  // With the stamp of simulated time where there is a clock, else of this machine. Throws ClientError if the
  // twin refuses the message.
  void send(const geometry_msgs::msg::Twist& twist);
  // Waits a short time for the network to take what was sent.
  void flush();

 private:
  template <class M>
  void send_message(const M& message, const std::optional<ros2::Publisher<M>>& publisher);

  Client& twin_;
  const VelocityTopic topic_;
  ros2::Node* node_;
  std::string frame_;
  std::optional<Time> clock_;
  std::optional<ros2::Publisher<geometry_msgs::msg::Twist>> plain_;  // one of them, with a node
  std::optional<ros2::Publisher<geometry_msgs::msg::TwistStamped>> stamped_;
};

}  // namespace doppel::app
