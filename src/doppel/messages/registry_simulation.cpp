#include "doppel/messages/doppel_msgs.h"
#include "doppel/messages/gazebo_msgs.h"
#include "doppel/messages/registry_detail.h"

namespace doppel::messages_detail {

void register_simulation_types() {
  namespace gazebo = gazebo_msgs::srv;
  namespace own = doppel_msgs::srv;
  register_messages<gazebo_msgs::msg::ModelState, gazebo_msgs::msg::EntityState,
                    gazebo_msgs::msg::ContactState, gazebo_msgs::msg::ContactsState>();
  register_messages<doppel_msgs::msg::TwinStatus, doppel_msgs::msg::JointLoads>();
  register_services<gazebo::ApplyJointEffort, gazebo::ApplyLinkWrench, gazebo::ApplyBodyWrench,
                    gazebo::JointRequest, gazebo::LinkRequest, gazebo::BodyRequest, gazebo::GetModelState,
                    gazebo::SetModelState, gazebo::GetJointProperties, gazebo::SetModelConfiguration,
                    gazebo::SpawnEntity, gazebo::DeleteEntity, gazebo::SetEntityState,
                    gazebo::GetEntityState>();
  register_services<own::Step, own::SetSpeed, own::GetState, own::SetState>();
}

}  // namespace doppel::messages_detail
