#include "doppel/ros/messages/service_event.h"

#include "doppel/ros/messages/detail/cdr_rewriter.h"
#include "doppel/ros/messages/detail/service_event_type.h"

namespace doppel {
namespace {

FieldDescription nested_field(std::string name, const TypeDescription& type, FieldShape shape) {
  FieldDescription field{.name = std::move(name), .kind = FieldKind::message, .shape = shape};
  if (shape == FieldShape::sequence) field.bound = 1;
  field.type = &type;
  return field;
}

Status append_at_most_one(const TypeSupport& type, std::span<const std::byte> cdr, CdrAppender& out) {
  out.number(static_cast<std::uint32_t>(cdr.empty() ? 0 : 1));
  return cdr.empty() ? Status() : append_cdr(*type.description(), cdr, out);
}

}  // namespace

TypeDescription event_description(const std::string& service, const TypeDescription& info,
                                  const TypeDescription& request, const TypeDescription& response) {
  TypeDescription type;
  type.name = service + "_Event";
  type.add(nested_field("info", info, FieldShape::single));
  type.add(nested_field("request", request, FieldShape::sequence));
  type.add(nested_field("response", response, FieldShape::sequence));
  return type;
}

const TypeDescription* messages_detail::ServiceEventType::description_in(Distro distro) const {
  return descriptions_.get(distro, [&] {
    return event_description(service_.name, describe<service_msgs::msg::ServiceEventInfo>(distro),
                             *service_.request->description_in(distro),
                             *service_.response->description_in(distro));
  });
}

const TypeSupport& event_type(const ServiceSupport& service) {
  register_service(service);
  return *find_type(service.name + "_Event");
}

Status write_event(const ServiceSupport& service, const service_msgs::msg::ServiceEventInfo& info,
                   std::span<const std::byte> request, std::span<const std::byte> response, Bytes& out) {
  CdrAppender event(out);
  Status status = append_cdr(describe<service_msgs::msg::ServiceEventInfo>(), to_cdr(info), event);
  if (status) status = append_at_most_one(*service.request, request, event);
  if (status) status = append_at_most_one(*service.response, response, event);
  return status;
}

}  // namespace doppel
