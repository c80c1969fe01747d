#include "doppel/ros/messages/detail/registry.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/linkattacher_msgs.h"
#include "doppel/ros/messages/ros_gz_interfaces.h"

namespace doppel::messages_detail {

namespace {

void register_gazebo_msgs() {
  namespace msg = gazebo_msgs::msg;
  namespace srv = gazebo_msgs::srv;
  register_messages<msg::ModelState, msg::EntityState, msg::ContactState, msg::ContactsState>();
  register_services<srv::ApplyJointEffort, srv::ApplyLinkWrench, srv::ApplyBodyWrench, srv::JointRequest,
                    srv::LinkRequest, srv::BodyRequest, srv::GetModelState, srv::SetModelState,
                    srv::GetJointProperties, srv::SetModelConfiguration, srv::SpawnEntity, srv::DeleteEntity,
                    srv::SetEntityState, srv::GetEntityState>();
}

void register_link_attachers() {
  register_services<linkattacher_msgs::srv::AttachLink, linkattacher_msgs::srv::DetachLink,
                    gazebo_ros_link_attacher::srv::Attach>();
}

void register_ros_gz() {
  namespace msg = ros_gz_interfaces::msg;
  namespace srv = ros_gz_interfaces::srv;
  register_messages<msg::Entity, msg::JointWrench, msg::Contact, msg::Contacts, msg::Altimeter,
                    msg::LogicalCameraImageModel, msg::LogicalCameraImage, msg::EntityFactory,
                    msg::WorldReset, msg::WorldControl>();
  register_services<srv::SpawnEntity, srv::DeleteEntity, srv::SetEntityPose, srv::ControlWorld>();
}

void register_doppel_msgs() {
  namespace msg = doppel_msgs::msg;
  namespace srv = doppel_msgs::srv;
  register_messages<msg::TwinStatus, msg::JointLoads, msg::Light, msg::PhysicalMaterial, msg::Terrain,
                    msg::Scene, msg::Sensor, msg::Sensors>();
  register_services<srv::Step, srv::SetSpeed, srv::GetState, srv::SetState>();
}

}  // namespace

void register_simulation_types() {
  register_gazebo_msgs();
  register_link_attachers();
  register_ros_gz();
  register_doppel_msgs();
}

}  // namespace doppel::messages_detail
