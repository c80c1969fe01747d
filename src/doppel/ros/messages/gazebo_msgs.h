#pragma once
// gazebo_msgs of gazebo_ros_pkgs (its ROS 2 branch): external efforts and wrenches, spawned and deleted
// entities, contacts. Durations of efforts and wrenches: negative is unlimited, zero has no effect.

#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel::gazebo_msgs::msg {

struct ModelState {
  std::string model_name;
  geometry_msgs::msg::Pose pose;
  geometry_msgs::msg::Twist twist;
  std::string reference_frame;  // empty or "world": the world
  DOPPEL_MESSAGE("gazebo_msgs/msg/ModelState", model_name, pose, twist, reference_frame)
};

struct EntityState {
  std::string name;
  geometry_msgs::msg::Pose pose;
  geometry_msgs::msg::Twist twist;
  std::string reference_frame;  // empty or "world": the world
  DOPPEL_MESSAGE("gazebo_msgs/msg/EntityState", name, pose, twist, reference_frame)
};

// Two collision shapes that touch; one element of each list per point.
struct ContactState {
  std::string info;
  std::string collision1_name, collision2_name;      // "model::link::collision"
  std::vector<geometry_msgs::msg::Wrench> wrenches;  // on the first, in the axes of the header's frame
  geometry_msgs::msg::Wrench total_wrench;           // their sum
  std::vector<geometry_msgs::msg::Vector3> contact_positions;  // m
  std::vector<geometry_msgs::msg::Vector3> contact_normals;    // unit, into the first
  std::vector<double> depths;                                  // m, positive: penetrating
  DOPPEL_MESSAGE("gazebo_msgs/msg/ContactState", info, collision1_name, collision2_name, wrenches,
                 total_wrench, contact_positions, contact_normals, depths)
};

struct ContactsState {
  std_msgs::msg::Header header;
  std::vector<ContactState> states;
  DOPPEL_MESSAGE("gazebo_msgs/msg/ContactsState", header, states)
};

}  // namespace doppel::gazebo_msgs::msg

namespace doppel::gazebo_msgs::srv {

struct ApplyJointEffort {
  struct Request {
    std::string joint_name;
    double effort = 0;
    builtin_interfaces::msg::Time start_time;
    builtin_interfaces::msg::Duration duration;
    DOPPEL_MESSAGE("gazebo_msgs/srv/ApplyJointEffort_Request", joint_name, effort, start_time, duration)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/ApplyJointEffort_Response", success, status_message)
  };
};

struct ApplyLinkWrench {
  struct Request {
    std::string link_name;
    std::string reference_frame;  // empty: the world
    geometry_msgs::msg::Point reference_point;
    geometry_msgs::msg::Wrench wrench;
    builtin_interfaces::msg::Time start_time;
    builtin_interfaces::msg::Duration duration;
    DOPPEL_MESSAGE("gazebo_msgs/srv/ApplyLinkWrench_Request", link_name, reference_frame, reference_point,
                   wrench, start_time, duration)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/ApplyLinkWrench_Response", success, status_message)
  };
};

// ROS 1's name of ApplyLinkWrench.
struct ApplyBodyWrench {
  struct Request {
    std::string body_name;
    std::string reference_frame;  // empty: the world
    geometry_msgs::msg::Point reference_point;
    geometry_msgs::msg::Wrench wrench;
    builtin_interfaces::msg::Time start_time;
    builtin_interfaces::msg::Duration duration;
    DOPPEL_MESSAGE("gazebo_msgs/srv/ApplyBodyWrench_Request", body_name, reference_frame, reference_point,
                   wrench, start_time, duration)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/ApplyBodyWrench_Response", success, status_message)
  };
};

struct JointRequest {
  struct Request {
    std::string joint_name;
    DOPPEL_MESSAGE("gazebo_msgs/srv/JointRequest_Request", joint_name)
  };
  struct Response {
    DOPPEL_EMPTY_MESSAGE("gazebo_msgs/srv/JointRequest_Response")
  };
};

struct LinkRequest {
  struct Request {
    std::string link_name;
    DOPPEL_MESSAGE("gazebo_msgs/srv/LinkRequest_Request", link_name)
  };
  struct Response {
    DOPPEL_EMPTY_MESSAGE("gazebo_msgs/srv/LinkRequest_Response")
  };
};

// ROS 1's name of LinkRequest.
struct BodyRequest {
  struct Request {
    std::string body_name;
    DOPPEL_MESSAGE("gazebo_msgs/srv/BodyRequest_Request", body_name)
  };
  struct Response {
    DOPPEL_EMPTY_MESSAGE("gazebo_msgs/srv/BodyRequest_Response")
  };
};

struct GetModelState {
  struct Request {
    std::string model_name;
    std::string relative_entity_name;
    DOPPEL_MESSAGE("gazebo_msgs/srv/GetModelState_Request", model_name, relative_entity_name)
  };
  struct Response {
    std_msgs::msg::Header header;
    geometry_msgs::msg::Pose pose;
    geometry_msgs::msg::Twist twist;
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/GetModelState_Response", header, pose, twist, success, status_message)
  };
};

struct SetModelState {
  struct Request {
    msg::ModelState model_state;
    DOPPEL_MESSAGE("gazebo_msgs/srv/SetModelState_Request", model_state)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/SetModelState_Response", success, status_message)
  };
};

struct GetJointProperties {
  struct Request {
    std::string joint_name;
    DOPPEL_MESSAGE("gazebo_msgs/srv/GetJointProperties_Request", joint_name)
  };
  struct Response {
    static constexpr std::uint8_t REVOLUTE = 0, CONTINUOUS = 1, PRISMATIC = 2, FIXED = 3, BALL = 4,
                                  UNIVERSAL = 5;
    std::uint8_t type = REVOLUTE;
    std::vector<double> damping, position, rate;
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/GetJointProperties_Response", type, damping, position, rate, success,
                   status_message)
    DOPPEL_CONSTANTS(REVOLUTE, CONTINUOUS, PRISMATIC, FIXED, BALL, UNIVERSAL)
  };
};

struct SetModelConfiguration {
  struct Request {
    std::string model_name;
    std::string urdf_param_name;
    std::vector<std::string> joint_names;
    std::vector<double> joint_positions;
    DOPPEL_MESSAGE("gazebo_msgs/srv/SetModelConfiguration_Request", model_name, urdf_param_name, joint_names,
                   joint_positions)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/SetModelConfiguration_Response", success, status_message)
  };
};

struct SpawnEntity {
  struct Request {
    std::string name;             // empty: the name in `xml`
    std::string xml;              // SDF or URDF
    std::string robot_namespace;  // of a robot's nodes; empty: its name
    geometry_msgs::msg::Pose initial_pose;
    std::string reference_frame;  // empty or "world": the world
    DOPPEL_MESSAGE("gazebo_msgs/srv/SpawnEntity_Request", name, xml, robot_namespace, initial_pose,
                   reference_frame)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/SpawnEntity_Response", success, status_message)
  };
};

struct DeleteEntity {
  struct Request {
    std::string name;
    DOPPEL_MESSAGE("gazebo_msgs/srv/DeleteEntity_Request", name)
  };
  struct Response {
    bool success = false;
    std::string status_message;
    DOPPEL_MESSAGE("gazebo_msgs/srv/DeleteEntity_Response", success, status_message)
  };
};

struct SetEntityState {
  struct Request {
    msg::EntityState state;
    DOPPEL_MESSAGE("gazebo_msgs/srv/SetEntityState_Request", state)
  };
  struct Response {
    bool success = false;
    DOPPEL_MESSAGE("gazebo_msgs/srv/SetEntityState_Response", success)
  };
};

struct GetEntityState {
  struct Request {
    std::string name;             // a model, or "model::link"
    std::string reference_frame;  // empty or "world": the world
    DOPPEL_MESSAGE("gazebo_msgs/srv/GetEntityState_Request", name, reference_frame)
  };
  struct Response {
    std_msgs::msg::Header header;
    msg::EntityState state;
    bool success = false;
    DOPPEL_MESSAGE("gazebo_msgs/srv/GetEntityState_Response", header, state, success)
  };
};

}  // namespace doppel::gazebo_msgs::srv
