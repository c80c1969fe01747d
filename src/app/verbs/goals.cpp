#include "app/verbs/goals.h"

#include <algorithm>

#include "app/verbs/field_value.h"
#include "app/verbs/log_lines.h"
#include "doppel/base/core/names.h"
#include "doppel/ros/messages/action_msgs.h"

namespace doppel::app {
namespace {

constexpr std::size_t kCdrHead = 4, kIdSize = 16;

FieldDescription field(std::string name, FieldKind kind, const TypeDescription* type = nullptr) {
  FieldDescription out;
  out.name = std::move(name);
  out.kind = kind;
  out.type = type;
  return out;
}

// The wrappers that rosidl derives from an action are described here, not compiled in for every action.
TypeDescription result_response(const ActionSupport& action) {
  TypeDescription type{.name = action.name + "_GetResult_Response", .fields = {}, .constants = {}};
  type.add(field("status", FieldKind::int8));
  type.add(field("result", FieldKind::message, action.result->description()));
  return type;
}

// A goal's id needs no alignment beyond its own sixteen bytes, so that what follows it keeps its own.
Bytes with_id(const GoalId& id, std::span<const std::byte> body) {
  Bytes out(kCdrHead + kIdSize + body.size());
  std::ranges::copy(kCdrLittleEndianHeader, out.begin());
  std::ranges::copy(std::as_bytes(std::span(id)), out.begin() + kCdrHead);
  std::ranges::copy(body, out.begin() + kCdrHead + kIdSize);
  return out;
}

// The part below "result:" in a response.
std::string result_part(const std::string& yaml) {
  constexpr std::size_t kIndent = 2;
  std::string out;
  for (std::size_t begin = yaml.find('\n', yaml.find("result:"));
       begin != std::string::npos && begin + kIndent + 1 < yaml.size();) {
    const std::size_t end = yaml.find('\n', begin + 1);
    out += yaml.substr(begin + 1 + kIndent, end == std::string::npos ? end : end - begin - kIndent);
    begin = end;
  }
  return out;
}

// The result's own words about a failure; "" if its type has none.
std::string reason_of(const ActionSupport& action, std::span<const std::byte> response) {
  const TypeDescription type = result_response(action);
  std::string text;
  for (const char* field : {"result.error_string", "result.stalled"}) {
    if (!check_field_path(type, field) || !field_as_yaml(type, response, field, text)) continue;
    while (!text.empty() && text.back() == '\n') text.pop_back();
    if (std::string_view(field).ends_with("stalled")) return text == "true" ? "the gripper stalled" : "";
    return text;
  }
  return "";
}

}  // namespace

std::string_view status_name(std::int8_t status) {
  constexpr std::string_view kNames[] = {"UNKNOWN",   "ACCEPTED", "EXECUTING", "CANCELING",
                                         "SUCCEEDED", "CANCELED", "ABORTED"};
  return status >= 0 && status < 7 ? kNames[status] : "UNKNOWN";
}

ActionGoal::ActionGoal(Client& twin, std::string action, const ActionSupport& type,
                       std::span<const std::byte> goal_cdr)
    : twin_(twin), action_(std::move(action)), type_(type), id_(new_goal_id()) {
  LogLines lines(twin_);
  const std::string service = action_ + std::string(kSendGoal);
  const Bytes response = call_raw(twin_, service, with_id(id_, goal_cdr.subspan(kCdrHead)));
  if (response.size() <= kCdrHead || response[kCdrHead] == std::byte{0}) {
    const std::vector<std::string>& servers = twin_.find_service(service).providers;
    throw ClientError(fmt::format("{} refused the goal{}", action_,
                                  lines.reason(servers.empty() ? action_ : servers.front())));
  }
  result_call_ = twin_.begin_call(action_ + "/_action/get_result", with_id(id_, {}));
}

std::string ActionGoal::feedback_yaml(const Client::Received& message) const {
  const std::span<const std::byte> cdr = message.cdr;
  if (message.topic != feedback_topic()) return "";
  if (cdr.size() < kCdrHead + kIdSize) return "";
  if (!std::ranges::equal(cdr.subspan(kCdrHead, kIdSize), std::as_bytes(std::span(id_)))) return "";
  Bytes feedback(cdr.begin(), cdr.begin() + kCdrHead);
  feedback.insert(feedback.end(), cdr.begin() + kCdrHead + kIdSize, cdr.end());
  std::string out;
  return type_.feedback->cdr_to_yaml(feedback, out) ? out : "";
}

bool ActionGoal::take_outcome(GoalOutcome& outcome) {
  Client::Answer answer;
  if (!twin_.take_answer(result_call_, answer)) return false;
  if (!answer.ok) throw ClientError(answer.why);
  if (answer.response.size() <= kCdrHead) throw ClientError("the result is empty");
  outcome.status = static_cast<std::int8_t>(answer.response[kCdrHead]);
  std::string yaml;
  if (const Status status = cdr_to_yaml(result_response(type_), answer.response, yaml); !status) {
    throw ClientError(status.why());
  }
  outcome.result_yaml = result_part(yaml);
  outcome.reason = reason_of(type_, answer.response);
  return true;
}

void ActionGoal::cancel() {
  action_msgs::srv::CancelGoal::Request request;
  request.goal_info.goal_id.uuid = id_;
  const auto response = call<action_msgs::srv::CancelGoal>(twin_, action_ + "/_action/cancel_goal", request);
  if (response.return_code != action_msgs::srv::CancelGoal::Response::ERROR_NONE) {
    throw ClientError(fmt::format("{} does not cancel the goal (code {})", action_, response.return_code));
  }
}

std::vector<std::string> action_list(Client& twin) {
  std::vector<std::string> names;
  for (const auto& [name, service] : twin.services()) {
    if (name.ends_with(kSendGoal)) names.push_back(name.substr(0, name.size() - kSendGoal.size()));
  }
  return names;
}

std::string find_action_type(Client& twin, const std::string& action) {
  const auto found = twin.services().find(action + std::string(kSendGoal));
  if (found == twin.services().end()) {
    throw ClientError(
        fmt::format("there is no action {}{}", action, did_you_mean(action, action_list(twin))));
  }
  return found->second.type.substr(0, found->second.type.rfind("_SendGoal"));
}

}  // namespace doppel::app
