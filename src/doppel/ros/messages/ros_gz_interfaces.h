#pragma once
// ros_gz_interfaces of ros_gz (its jazzy branch): gz-sim's services to create, remove and move entities and to control
// a world, and what its contact sensors see.

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::ros_gz_interfaces::msg {

struct Entity {
  static constexpr std::uint8_t NONE = 0, LIGHT = 1, MODEL = 2, LINK = 3, VISUAL = 4, COLLISION = 5,
                                SENSOR = 6, JOINT = 7;
  std::uint64_t id = 0;  // unique across all types
  std::string name;
  std::uint8_t type = NONE;
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/Entity", id, name, type)
  DOPPEL_CONSTANTS(NONE, LIGHT, MODEL, LINK, VISUAL, COLLISION, SENSOR, JOINT)
};

// One of sdf, sdf_filename and clone_name.
struct EntityFactory {
  std::string name;             // instead of the one in the SDF
  bool allow_renaming = false;  // where an entity has this name
  std::string sdf, sdf_filename, clone_name;
  geometry_msgs::msg::Pose pose;      // relative to this entity:
  std::string relative_to = "world";  // empty: the world
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/EntityFactory", name, allow_renaming, sdf, sdf_filename, clone_name,
                 pose, relative_to)
};

struct JointWrench {
  std_msgs::msg::Header header;
  std_msgs::msg::String body_1_name;
  std_msgs::msg::UInt32 body_1_id;
  std_msgs::msg::String body_2_name;
  std_msgs::msg::UInt32 body_2_id;
  geometry_msgs::msg::Wrench body_1_wrench, body_2_wrench;  // on each of the bodies
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/JointWrench", header, body_1_name, body_1_id, body_2_name, body_2_id,
                 body_1_wrench, body_2_wrench)
};

// Of two collisions; the lists have an element for each point.
struct Contact {
  Entity collision1, collision2;
  std::vector<geometry_msgs::msg::Vector3> positions;  // m
  std::vector<geometry_msgs::msg::Vector3> normals;    // unit
  std::vector<double> depths;                          // m, positive: penetrating
  std::vector<JointWrench> wrenches;
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/Contact", collision1, collision2, positions, normals, depths,
                 wrenches)
};

struct Contacts {
  std_msgs::msg::Header header;
  std::vector<Contact> contacts;
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/Contacts", header, contacts)
};

// m, and m/s upwards, from the height at the start.
struct Altimeter {
  std_msgs::msg::Header header;
  double vertical_position = 0, vertical_velocity = 0, vertical_reference = 0;
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/Altimeter", header, vertical_position, vertical_velocity,
                 vertical_reference)
};

// The pose is in the sensor's frame.
struct LogicalCameraImageModel {
  std::string name;
  geometry_msgs::msg::Pose pose;
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/LogicalCameraImageModel", name, pose)
};

struct LogicalCameraImage {
  std_msgs::msg::Header header;
  geometry_msgs::msg::Pose pose;  // of the sensor, in the world
  std::vector<LogicalCameraImageModel> model;
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/LogicalCameraImage", header, pose, model)
};

struct WorldReset {
  bool all = false, time_only = false, model_only = false;
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/WorldReset", all, time_only, model_only)
};

struct WorldControl {
  bool pause = false, step = false;
  std::uint32_t multi_step = 0;  // steps, then paused
  WorldReset reset;
  std::uint32_t seed = 0;
  builtin_interfaces::msg::Time run_to_sim_time;  // then paused
  DOPPEL_MESSAGE("ros_gz_interfaces/msg/WorldControl", pause, step, multi_step, reset, seed, run_to_sim_time)
};

}  // namespace doppel::ros_gz_interfaces::msg

namespace doppel::ros_gz_interfaces::srv {

struct SpawnEntity {
  struct Request {
    msg::EntityFactory entity_factory;
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/SpawnEntity_Request", entity_factory)
  };
  struct Response {
    bool success = false;
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/SpawnEntity_Response", success)
  };
};

struct DeleteEntity {
  struct Request {
    msg::Entity entity;
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/DeleteEntity_Request", entity)
  };
  struct Response {
    bool success = false;
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/DeleteEntity_Response", success)
  };
};

struct SetEntityPose {
  struct Request {
    msg::Entity entity;
    geometry_msgs::msg::Pose pose;  // in the world
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/SetEntityPose_Request", entity, pose)
  };
  struct Response {
    bool success = false;
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/SetEntityPose_Response", success)
  };
};

struct ControlWorld {
  struct Request {
    msg::WorldControl world_control;
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/ControlWorld_Request", world_control)
  };
  struct Response {
    bool success = false;
    DOPPEL_MESSAGE("ros_gz_interfaces/srv/ControlWorld_Response", success)
  };
};

}  // namespace doppel::ros_gz_interfaces::srv
