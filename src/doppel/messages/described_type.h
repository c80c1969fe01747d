#pragma once
// Types that are not compiled in, known from a description alone: what another node answers to
// ~/get_type_description. Descriptions come from the network, so everything about them is checked.

#include <memory>

#include "doppel/export.h"
#include "doppel/messages/type_description_message.h"

namespace doppel {

// A message type by its description; null, with the reason in `status`, where it is refused: names that ROS 2
// does not allow, unknown kinds, types that are missing, twice there or contain themselves, and messages that
// could not be shorter than 64 MiB. It is not entered into the registry, so it may differ from a type of the
// same name there; its hash() tells. Any thread.
DOPPEL_API std::shared_ptr<const TypeSupport> described_type(const TypeDescriptionMessage& message,
                                                             Status& status);

}  // namespace doppel
