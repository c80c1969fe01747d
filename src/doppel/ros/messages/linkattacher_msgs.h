#pragma once
// linkattacher_msgs of IFRA_LinkAttacher (https://github.com/IFRA-Cranfield/IFRA_LinkAttacher), and the service of
// gazebo_ros_link_attacher: requests of Gazebo's users to fix a link of one model to a link of another.

#include "doppel/ros/messages/message.h"

namespace doppel::linkattacher_msgs::srv {

struct AttachLink {
  struct Request {
    std::string model1_name, link1_name, model2_name, link2_name;
    DOPPEL_MESSAGE("linkattacher_msgs/srv/AttachLink_Request", model1_name, link1_name, model2_name,
                   link2_name)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("linkattacher_msgs/srv/AttachLink_Response", success, message)
  };
};

struct DetachLink {
  struct Request {
    std::string model1_name, link1_name, model2_name, link2_name;
    DOPPEL_MESSAGE("linkattacher_msgs/srv/DetachLink_Request", model1_name, link1_name, model2_name,
                   link2_name)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("linkattacher_msgs/srv/DetachLink_Response", success, message)
  };
};

}  // namespace doppel::linkattacher_msgs::srv

namespace doppel::gazebo_ros_link_attacher::srv {

struct Attach {
  struct Request {
    std::string model_name_1, link_name_1, model_name_2, link_name_2;
    DOPPEL_MESSAGE("gazebo_ros_link_attacher/srv/Attach_Request", model_name_1, link_name_1, model_name_2,
                   link_name_2)
  };
  struct Response {
    bool ok = false;
    DOPPEL_MESSAGE("gazebo_ros_link_attacher/srv/Attach_Response", ok)
  };
};

}  // namespace doppel::gazebo_ros_link_attacher::srv
