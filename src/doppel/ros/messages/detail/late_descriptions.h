#pragma once
// The description of a type in each distribution, made at its first use: most programs need a few of the
// types. Any thread.

#include <array>
#include <mutex>

#include "doppel/ros/messages/distro.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel::messages_detail {

class LateDescriptions {
 public:
  template <class Make>
  const TypeDescription* get(Distro distro, const Make& make) const {
    Late& late = late_[static_cast<std::size_t>(distro)];
    std::call_once(late.once, [&] { late.description = make(); });
    return &late.description;
  }

 private:
  struct Late {
    std::once_flag once;
    TypeDescription description;
  };
  mutable std::array<Late, kDistros> late_;
};

}  // namespace doppel::messages_detail
