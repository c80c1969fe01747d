#pragma once
// The events of a service's calls, as rcl publishes them on <service>/_service_event (service introspection):
// who called, when, and the request or the response. Their type is "<service type>_Event", as rosidl derives
// it.

#include <span>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/service_msgs.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel {

// find_type() knows it as well, as soon as the service is registered. Any thread.
DOPPEL_API const TypeSupport& event_type(const ServiceSupport& service);

// The CDR form of an event; without the request or response where the span is empty. Refuses bytes that are
// not of the service's types.
DOPPEL_API Status write_event(const ServiceSupport& service, const service_msgs::msg::ServiceEventInfo& info,
                              std::span<const std::byte> request, std::span<const std::byte> response,
                              Bytes& out);

// The description of the type of the events of a service.
DOPPEL_API TypeDescription event_description(const std::string& service, const TypeDescription& info,
                                             const TypeDescription& request, const TypeDescription& response);

}  // namespace doppel
