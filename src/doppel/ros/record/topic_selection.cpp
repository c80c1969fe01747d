#include "doppel/ros/record/topic_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

bool holds(const std::vector<std::string>& names, std::string_view name) {
  return !name.empty() && std::ranges::find(names, name) != names.end();
}

bool matches(const std::string& expression, std::string_view name) {
  return !expression.empty() && std::regex_search(name.begin(), name.end(), std::regex(expression));
}

void check_expression(const std::string& expression, const char* option) {
  try {
    const std::regex compiled(expression);
  } catch (const std::regex_error& error) {
    throw InputError(
        "cli.use", {},
        fmt::format("'{}' of {} is not a regular expression: {}", expression, option, error.what()),
        "escape ( ) [ ] . * + ? with a backslash where they are meant as characters");
  }
}

}  // namespace

std::string_view service_of_event_topic(std::string_view topic) {
  constexpr std::string_view kEnd = "/_service_event";
  return topic.ends_with(kEnd) ? topic.substr(0, topic.size() - kEnd.size()) : std::string_view();
}

std::string_view action_of_topic(std::string_view topic) {
  const std::size_t found = topic.find("/_action/");
  return found == std::string_view::npos ? std::string_view() : topic.substr(0, found);
}

void TopicSelection::check() const {
  check_expression(regex, "--regex");
  check_expression(exclude_regex, "--exclude-regex");
}

bool TopicSelection::includes(std::string_view topic, std::string_view type) const {
  const std::string_view action = action_of_topic(topic);
  const std::string_view service = action.empty() ? service_of_event_topic(topic) : std::string_view();
  if (holds(topics, topic) || holds(services, service) || holds(actions, action) || holds(types, type) ||
      matches(regex, topic))
    return true;
  const bool nothing_chosen = topics.empty() && services.empty() && actions.empty() && types.empty() &&
                              regex.empty() && !all_topics && !all_services && !all_actions;
  const bool everything = all || nothing_chosen;
  if (!action.empty()) return everything || all_actions;
  if (!service.empty()) return everything || all_services;
  return (everything || all_topics) && (hidden || topic.find("/_") == std::string_view::npos);
}

bool TopicSelection::selects(std::string_view topic, std::string_view type) const {
  if (!includes(topic, type) || holds(exclude_topics, topic) || holds(exclude_types, type) ||
      matches(exclude_regex, topic))
    return false;
  const std::string_view action = action_of_topic(topic);
  return !holds(exclude_actions, action) &&
         (!action.empty() || !holds(exclude_services, service_of_event_topic(topic)));
}

}  // namespace doppel
