#pragma once
// The type of a service's events, made from the descriptions of its request and its response.

#include <array>
#include <mutex>

#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel::messages_detail {

class ServiceEventType final : public TypeSupport {
 public:
  explicit ServiceEventType(const ServiceSupport& service)
      : TypeSupport(service.name + "_Event"), service_(service) {}

  [[nodiscard]] const TypeDescription* description_in(Distro distro) const override;

 private:
  struct Late {
    std::once_flag once;
    TypeDescription description;
  };
  const ServiceSupport& service_;
  mutable std::array<Late, kDistros> late_;
};

}  // namespace doppel::messages_detail
