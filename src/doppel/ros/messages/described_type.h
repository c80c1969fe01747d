#pragma once
// Types that are not compiled in, known only from a description: the response of another node to
// ~/get_type_description. Descriptions are received from the network, so they are checked completely.

#include <memory>

#include "doppel/export.h"
#include "doppel/ros/messages/type_description_message.h"

namespace doppel {

// A message type by its description. Returns nullptr, with the reason in `status`, for names that ROS 2 does
// not allow, unknown kinds, types that are missing, repeated or contain themselves, and messages of at least
// 64 MiB. It is not added to the registry, so it may differ from a type of the same name there; hash() shows
// it. Any thread.
DOPPEL_API std::shared_ptr<const TypeSupport> described_type(const TypeDescriptionMessage& message,
                                                             Status& status);

}  // namespace doppel
