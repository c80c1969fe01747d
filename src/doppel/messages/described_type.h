#pragma once
// Types that are not compiled in, known from a description alone: what another node answers to
// ~/get_type_description. Descriptions come from the network, so everything about them is checked.

#include <deque>
#include <memory>

#include "doppel/messages/type_description_message.h"

namespace doppel {

// Owns a type's description and those of all types that it refers to.
class DescribedTypes {
 public:
  // Refuses names that ROS 2 does not allow, unknown kinds, types that are missing, twice there or contain
  // themselves, and messages that could not be shorter than 64 MiB. Any thread.
  static std::shared_ptr<const DescribedTypes> read(const TypeDescriptionMessage& message, Status& status);

  [[nodiscard]] const TypeDescription& top() const { return types_.front(); }
  [[nodiscard]] const std::deque<TypeDescription>& types() const { return types_; }  // the top one first

 private:
  friend class DescriptionReader;
  std::deque<TypeDescription> types_;  // at places that stay: they point at each other
};

// A message type by its description; null, with the reason in `status`, where it is refused. It is not
// entered into the registry, so it may differ from a type of the same name there. Its hash() tells.
std::shared_ptr<const TypeSupport> described_type(const TypeDescriptionMessage& message, Status& status);

// Enters the described message, service or action, with its parts and the messages it refers to, into the
// registry for good. Refused where the registry has another type of this name.
Status learn_type(const TypeDescriptionMessage& message);

}  // namespace doppel
