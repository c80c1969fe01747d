#pragma once
// The lists of built-in types, in several sources so that each compiles quickly.

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/messages/codec.h"

namespace doppel::messages_detail {

void register_standard_types();
void register_sensing_types();
void register_control_types();
void register_manager_types();
void register_rcl_types();
void register_simulation_types();

template <Message... M>
void register_messages() {
  (register_type(type_support<M>()), ...);
}
template <Service... S>
void register_services() {
  (register_service(service_support<S>()), ...);
}
// Including the types that rosidl derives from an action.
template <Action... A>
void register_actions() {
  (register_action(action_support<A>()), ...);
  (register_service(service_support<SendGoal<A>>()), ...);
  (register_service(service_support<GetResult<A>>()), ...);
  (register_type(type_support<FeedbackMessage<A>>()), ...);
}

}  // namespace doppel::messages_detail
