#include <deque>
#include <map>
#include <mutex>
#include <shared_mutex>

#include "doppel/ros/messages/detail/builtin_types.h"
#include "doppel/ros/messages/detail/service_event_type.h"

namespace doppel {
namespace {

struct Registry {
  std::shared_mutex mutex;
  std::map<std::string, const TypeSupport*, std::less<>> types;
  std::map<std::string, const ServiceSupport*, std::less<>> services;
  std::map<std::string, const ActionSupport*, std::less<>> actions;
  std::deque<messages_detail::ServiceEventType> events;  // a deque, for stable addresses
};

Registry& tables() {
  static Registry registry;
  return registry;
}

// The built-in types are added at first use, so that the order of static initialisers does not matter.
Registry& filled_tables() {
  static std::once_flag once;
  std::call_once(once, messages_detail::register_builtin_types);
  return tables();
}

template <class Support>
const Support* find_in(const std::map<std::string, const Support*, std::less<>>& entries,
                       std::string_view name, std::initializer_list<std::string_view> kinds) {
  if (const auto found = entries.find(name); found != entries.end()) return found->second;
  const std::size_t slash = name.find('/');
  if (slash == std::string_view::npos || slash != name.rfind('/')) return nullptr;
  for (const std::string_view kind : kinds) {
    const std::string full =
        std::string(name.substr(0, slash)) + std::string(kind) + std::string(name.substr(slash));
    if (const auto found = entries.find(full); found != entries.end()) return found->second;
  }
  return nullptr;
}

template <class Support>
void enter(std::map<std::string, const Support*, std::less<>>& entries, const Support& support) {
  const std::unique_lock lock(tables().mutex);
  entries.emplace(support.name, &support);
}

}  // namespace

const TypeSupport* find_type(std::string_view name) {
  Registry& registry = filled_tables();
  const std::shared_lock lock(registry.mutex);
  return find_in(registry.types, name, {"/msg", "/srv", "/action"});
}

const ServiceSupport* find_service(std::string_view name) {
  Registry& registry = filled_tables();
  const std::shared_lock lock(registry.mutex);
  return find_in(registry.services, name, {"/srv", "/action"});
}

const ActionSupport* find_action(std::string_view name) {
  Registry& registry = filled_tables();
  const std::shared_lock lock(registry.mutex);
  return find_in(registry.actions, name, {"/action"});
}

std::vector<std::string> type_names() {
  Registry& registry = filled_tables();
  const std::shared_lock lock(registry.mutex);
  std::vector<std::string> names;
  for (const auto& [name, support] : registry.types) {
    if (name.find("/msg/") != std::string::npos) names.push_back(name);
  }
  return names;
}

std::vector<std::string> service_names() {
  Registry& registry = filled_tables();
  const std::shared_lock lock(registry.mutex);
  std::vector<std::string> names;
  for (const auto& [name, support] : registry.services) names.push_back(name);
  return names;
}

std::vector<std::string> action_names() {
  Registry& registry = filled_tables();
  const std::shared_lock lock(registry.mutex);
  std::vector<std::string> names;
  for (const auto& [name, support] : registry.actions) names.push_back(name);
  return names;
}

void register_type(const TypeSupport& type) {
  enter(tables().types, type);
}

void register_service(const ServiceSupport& service) {
  register_type(*service.request);
  register_type(*service.response);
  Registry& registry = tables();
  const std::unique_lock lock(registry.mutex);
  if (!registry.services.emplace(service.name, &service).second) return;
  const auto& event = registry.events.emplace_back(service);
  registry.types.emplace(event.name, &event);
}

void register_action(const ActionSupport& action) {
  for (const TypeSupport* part : {action.goal, action.result, action.feedback}) register_type(*part);
  enter(tables().actions, action);
}

}  // namespace doppel
