#include "doppel/ros/network/node.h"

#include <fmt/format.h>

#include "doppel/base/core/names.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/bus/rosout.h"
#include "doppel/ros/bus/standard_node.h"
#include "doppel/ros/messages/rosgraph_msgs.h"

namespace doppel::ros2 {
namespace {

constexpr const char* kUseSimTime = "use_sim_time";

std::string checked_name(std::string_view name, std::string_view name_space) {
  std::string whole(name_space);
  if (!whole.starts_with('/')) whole.insert(0, "/");
  if (const Status status = check_namespace(whole); !status)
    throw InputError("ros2.namespace", {},
                     fmt::format("'{}' is not a valid namespace: {}", name_space, status.why()));
  if (const Status status = check_node_name(name); !status)
    throw InputError("ros2.node_name", {},
                     fmt::format("'{}' is not a valid node name: {}", name, status.why()));
  return fmt::format("{}{}{}", whole, whole == "/" ? "" : "/", name);
}

std::uint8_t log_level(Severity severity) {
  using rcl_interfaces::msg::Log;
  return severity == Severity::note ? Log::INFO : severity == Severity::warning ? Log::WARN : Log::ERROR;
}

}  // namespace

Node::Node(Context& context, std::string_view name, std::string_view name_space)
    : context_(context),
      node_(std::make_unique<doppel::Node>(context.bus(), checked_name(name, name_space))),
      overrides_(context.overrides_for(*node_)),
      rosout_(node_->advertise<rcl_interfaces::msg::Log>("/rosout", Qos::rosout())) {
  make_standard(*node_, true);
  on_parameter_change([this](const std::string& parameter, const ParameterValue& value) {
    if (parameter == kUseSimTime) follow_clock(std::get<bool>(value));
  });
  follow_clock(declare_parameter(kUseSimTime, false, "Use /clock as the time source"));
}

Node::~Node() = default;

std::string Node::resolve(doppel::NameKind kind, std::string_view name) const {
  return node_->bus().names().resolve(kind, name, node_->name());
}

Time Node::now() const {
  if (use_sim_time_) return context_.sim_time().value_or(Time{});
  return system_time();
}

void Node::follow_clock(bool use_sim_time) {
  use_sim_time_ = use_sim_time;
  if (!use_sim_time || has_clock_) return;
  has_clock_ = true;
  node_->subscribe<rosgraph_msgs::msg::Clock>(
      "/clock",
      [this](const rosgraph_msgs::msg::Clock& message) {
        if (use_sim_time_) context_.set_sim_time(from_msg(message.clock));
      },
      Qos::clock_subscription());
}

std::shared_ptr<Timer> Node::create_wall_timer(std::chrono::nanoseconds period,
                                               std::function<void()> callback) {
  auto timer = std::make_shared<Timer>(period, true, now(), std::move(callback));
  context_.add(timer);
  return timer;
}

std::shared_ptr<Timer> Node::create_timer(std::chrono::nanoseconds period, std::function<void()> callback) {
  auto timer = std::make_shared<Timer>(period, false, now(), std::move(callback));
  context_.add(timer);
  return timer;
}

std::shared_ptr<RemoteService> Node::make_client(const std::string& service, const ServiceSupport& support) {
  register_service(support);
  return context_.bridge().make_client(node_->name(), service, support.name);
}

ParameterValue Node::declare(const std::string& name, ParameterValue initial,
                             const std::string& description) {
  DeclareOptions options;
  options.description = description;
  return doppel::declare_parameter(node_->parameters(), &overrides_, name, std::move(initial),
                                   std::move(options));
}

const ParameterValue& Node::value_of(std::string_view parameter) const {
  if (const auto* declared = node_->parameters().find(parameter)) return declared->value;
  throw std::logic_error(fmt::format("parameter '{}' is not declared{}", parameter,
                                     did_you_mean(parameter, node_->parameters().names())));
}

void Node::on_parameter_change(
    std::function<void(const std::string& name, const ParameterValue& value)> listener) {
  node_->parameters().on_change(
      [this, call = std::move(listener)](const std::string& name, const ParameterValue& value) {
        context_.run([&] { call(name, value); });
      });
}

void Node::log(Severity severity, const std::string& text, const CodeLocation& where) const {
  if (!context_.is_logged(severity)) return;
  rcl_interfaces::msg::Log line;
  line.stamp = to_time_msg(now());
  line.level = log_level(severity);
  line.name = logger_name(name());
  line.msg = text;
  fill_place(line, where);
  rosout_.publish(line, context_.bus().now());
  context_.log(severity, line.name, text);
}

}  // namespace doppel::ros2
