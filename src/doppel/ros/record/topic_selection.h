#pragma once
// The topics that a recorder, a player or a copy takes, by the rules of ros2 bag.

#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// Without any of the first group all topics are selected. Services and actions are topics here: the events of
// a service (<service>/_service_event), and all topics of an action (<action>/_action/...).
struct DOPPEL_API TopicSelection {
  std::vector<std::string> topics = {}, services = {}, actions = {}, types = {};  // full names
  std::string regex = {};  // ECMAScript, found anywhere in a name
  bool all = false, all_topics = false, all_services = false, all_actions = false;

  std::vector<std::string> exclude_topics = {}, exclude_types = {};
  std::string exclude_regex = {};
  bool hidden = false;  // also other hidden topics, which have a part that begins with an underscore
  std::vector<std::string> exclude_services = {}, exclude_actions = {};

  // Throws InputError "cli.use" for an expression that is not valid.
  void check() const;
  [[nodiscard]] bool selects(std::string_view topic, std::string_view type) const;

 private:
  [[nodiscard]] bool includes(std::string_view topic, std::string_view type) const;
};

// "/arm/save" of "/arm/save/_service_event"; "/arm/follow" of a topic of an action; empty: of none.
[[nodiscard]] DOPPEL_API std::string_view service_of_event_topic(std::string_view topic);
[[nodiscard]] DOPPEL_API std::string_view action_of_topic(std::string_view topic);

}  // namespace doppel
