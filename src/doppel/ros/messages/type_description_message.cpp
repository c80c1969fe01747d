#include "doppel/ros/messages/type_description_message.h"

#include <deque>
#include <map>

#include "doppel/ros/messages/action_msgs.h"
#include "doppel/ros/messages/service_event.h"

namespace doppel {
namespace {

using type_description_interfaces::msg::Field;
using type_description_interfaces::msg::IndividualTypeDescription;

constexpr std::uint8_t kIds[] = {15, 16, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 14, 17, 18, 1};
constexpr std::uint8_t kBoundedTextId = 4;  // added to the id of a bounded string

std::string default_value(const FieldDescription& field) {
  if (field.initial == 0 || field.shape != FieldShape::single) return {};
  if (field.kind == FieldKind::boolean) return "True";
  if (field.kind == FieldKind::float32 || field.kind == FieldKind::float64)
    return shortest_decimal(field.initial);
  return std::to_string(static_cast<std::int64_t>(field.initial));
}

Field message_of(const FieldDescription& field) {
  Field out{.name = field.name, .type = {}, .default_value = default_value(field)};
  out.type.type_id = type_id(field);
  if (field.shape != FieldShape::single)
    out.type.capacity = field.shape == FieldShape::array ? field.count : field.bound;
  out.type.string_capacity = field.text_bound;
  if (field.type != nullptr) out.type.nested_type_name = field.type->name;
  return out;
}

IndividualTypeDescription individual(const TypeDescription& type) {
  IndividualTypeDescription out{.type_name = type.name, .fields = {}};
  for (const FieldDescription& field : type.fields) out.fields.push_back(message_of(field));
  if (type.fields.empty()) {
    FieldDescription only;
    only.name = kOnlyMember;
    only.kind = FieldKind::uint8;
    out.fields.push_back(message_of(only));
  }
  return out;
}

void collect(const TypeDescription& type, std::map<std::string_view, const TypeDescription*>& types) {
  for (const FieldDescription& field : type.fields) {
    if (field.type != nullptr && types.emplace(field.type->name, field.type).second)
      collect(*field.type, types);
  }
}

// `encoding` and `text` are the top type's, where it is not a message.
TypeSources sources(const TypeDescription& type, std::string_view encoding, std::string text) {
  std::map<std::string_view, const TypeDescription*> types;
  collect(type, types);
  const auto source = [](const TypeDescription& each) {
    const bool is_message = each.name.find("/msg/") != std::string::npos;
    return type_description_interfaces::msg::TypeSource{each.name, is_message ? "msg" : "implicit",
                                                        is_message ? definition_text(each) : ""};
  };
  TypeSources all = {source(type)};
  if (!encoding.empty()) all.front() = {type.name, std::string(encoding), std::move(text)};
  for (const auto& [name, referenced] : types) all.push_back(source(*referenced));
  return all;
}

// The types that rosidl derives from a service or an action; they are described here, not compiled in.
class Derived {
 public:
  const TypeDescription& make(std::string name, std::vector<FieldDescription> fields) {
    TypeDescription& type = types_.emplace_back();
    type.name = std::move(name);
    for (FieldDescription& field : fields) type.add(std::move(field));
    return type;
  }
  static FieldDescription nested(std::string name, const TypeDescription& type) {
    FieldDescription field;
    field.name = std::move(name);
    field.kind = FieldKind::message;
    field.type = &type;
    return field;
  }
  static FieldDescription number(std::string name, FieldKind kind) {
    FieldDescription field;
    field.name = std::move(name);
    field.kind = kind;
    return field;
  }

  const TypeDescription& service(const std::string& name, const TypeDescription& request,
                                 const TypeDescription& response) {
    const TypeDescription& event = types_.emplace_back(
        event_description(name, describe<service_msgs::msg::ServiceEventInfo>(), request, response));
    return make(name, {nested("request_message", request), nested("response_message", response),
                       nested("event_message", event)});
  }

  const TypeDescription& action(const ActionSupport& action) {
    const TypeDescription &goal = *action.goal->description(), &result = *action.result->description(),
                          &feedback = *action.feedback->description();
    const FieldDescription id = nested("goal_id", describe<unique_identifier_msgs::msg::UUID>());
    const std::string send_goal = action.name + "_SendGoal", get_result = action.name + "_GetResult";
    const TypeDescription& send_goal_service =
        service(send_goal, make(send_goal + "_Request", {id, nested("goal", goal)}),
                make(send_goal + "_Response", {number("accepted", FieldKind::boolean),
                                               nested("stamp", describe<builtin_interfaces::msg::Time>())}));
    const TypeDescription& get_result_service = service(
        get_result, make(get_result + "_Request", {id}),
        make(get_result + "_Response", {number("status", FieldKind::int8), nested("result", result)}));
    const TypeDescription& feedback_message =
        make(action.name + "_FeedbackMessage", {id, nested("feedback", feedback)});
    return make(action.name, {nested("goal", goal), nested("result", result), nested("feedback", feedback),
                              nested("send_goal_service", send_goal_service),
                              nested("get_result_service", get_result_service),
                              nested("feedback_message", feedback_message)});
  }

 private:
  std::deque<TypeDescription> types_;  // a deque, for stable addresses
};

}  // namespace

std::uint8_t type_id(const FieldDescription& field) {
  std::uint8_t id = kIds[static_cast<std::size_t>(field.kind)];
  if (field.text_bound > 0) id += kBoundedTextId;
  if (field.shape == FieldShape::array) id += kArrayId;
  if (field.shape == FieldShape::sequence) id += field.bound > 0 ? kBoundedSequenceId : kUnboundedSequenceId;
  return id;
}

TypeDescriptionMessage description_message(const TypeDescription& type) {
  std::map<std::string_view, const TypeDescription*> types;
  collect(type, types);
  TypeDescriptionMessage message{.type_description = individual(type), .referenced_type_descriptions = {}};
  for (const auto& [name, referenced] : types)
    message.referenced_type_descriptions.push_back(individual(*referenced));
  return message;
}

TypeDescriptionMessage description_message(const ServiceSupport& service) {
  Derived derived;
  return description_message(
      derived.service(service.name, *service.request->description(), *service.response->description()));
}

TypeDescriptionMessage description_message(const ActionSupport& action) {
  Derived derived;
  return description_message(derived.action(action));
}

TypeSources type_sources(const TypeDescription& type) {
  return sources(type, "", "");
}

TypeSources type_sources(const ServiceSupport& service) {
  Derived derived;
  const TypeDescription &request = *service.request->description(),
                        &response = *service.response->description();
  return sources(derived.service(service.name, request, response), "srv",
                 definition_text(request) + "---\n" + definition_text(response));
}

TypeSources type_sources(const ActionSupport& action) {
  Derived derived;
  const std::string text = definition_text(*action.goal->description()) + "---\n" +
                           definition_text(*action.result->description()) + "---\n" +
                           definition_text(*action.feedback->description());
  return sources(derived.action(action), "action", text);
}

}  // namespace doppel
