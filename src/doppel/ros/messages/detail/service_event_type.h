#pragma once
// The type of a service's events, made from the descriptions of its request and its response.

#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/detail/late_descriptions.h"

namespace doppel::messages_detail {

class ServiceEventType final : public TypeSupport {
 public:
  explicit ServiceEventType(const ServiceSupport& service)
      : TypeSupport(service.name + "_Event"), service_(service) {}

  [[nodiscard]] const TypeDescription* description_in(Distro distro) const override;

 private:
  const ServiceSupport& service_;
  LateDescriptions descriptions_;
};

}  // namespace doppel::messages_detail
