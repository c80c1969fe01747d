#pragma once
// A node of a user program, as in rclcpp: publishers, subscriptions, services, clients, parameters, and a log
// on /rosout. For threads see context.h.
//
// Subscriptions, services and action servers exist as long as their node; publishers and clients are handles
// that are valid as long as the node. Names are relative to the namespace, private ("~/x") or absolute, and
// are remapped by `--ros-args -r`.

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/network/context.h"

namespace doppel::ros2 {

template <Message M>
class Publisher {
 public:
  Publisher() = default;
  void publish(const M& message) const { on_bus_.publish(message, context_->bus().now()); }
  // The number of subscriptions of others that get later messages.
  [[nodiscard]] std::size_t subscription_count() const { return context_->bridge().matches(topic_).readers; }
  // Spins until there are that many; false: the time is over.
  bool wait_for_subscriptions(std::size_t count, std::chrono::nanoseconds at_most) const {
    return context_->spin_until([&] { return subscription_count() >= count; }, at_most);
  }

 private:
  friend class Node;
  Publisher(Context& context, std::string topic, doppel::Publisher<M> on_bus)
      : context_(&context), topic_(std::move(topic)), on_bus_(on_bus) {}
  Context* context_ = nullptr;
  std::string topic_;
  doppel::Publisher<M> on_bus_;
};

// A client of a service; responses are handled while the context spins.
template <Service S>
class Client {
 public:
  using Request = typename S::Request;
  using Response = typename S::Response;

  Client() = default;
  [[nodiscard]] bool service_is_ready() const { return remote_->is_available(); }
  // Spins until a server is ready; false: the time is over.
  bool wait_for_service(std::chrono::nanoseconds at_most) const {
    return context_->spin_until([this] { return service_is_ready(); }, at_most);
  }

  // A request without a ready server is lost and never gets a response.
  void async_send_request(const Request& request, std::function<void(const Response&)> callback) const {
    send(request, std::move(callback));
  }
  [[nodiscard]] std::future<Response> async_send_request(const Request& request) const {
    auto promise = std::make_shared<std::promise<Response>>();
    send(request, [promise](const Response& response) { promise->set_value(response); });
    return promise->get_future();
  }
  // Spins until a server is ready and its response is here; nullopt: the time is over. Not in callbacks.
  std::optional<Response> call(const Request& request, std::chrono::nanoseconds at_most) const {
    const auto begin = std::chrono::steady_clock::now();
    if (!wait_for_service(at_most)) return std::nullopt;
    auto answer = std::make_shared<std::optional<Response>>();
    const std::uint64_t number = send(request, [answer](const Response& response) { *answer = response; });
    const auto left = at_most - (std::chrono::steady_clock::now() - begin);
    if (!context_->spin_until([&] { return answer->has_value(); }, left)) remote_->forget(number);
    return *answer;
  }

 private:
  friend class Node;
  Client(Context& context, std::shared_ptr<RemoteService> remote)
      : context_(&context), remote_(std::move(remote)) {}

  // A response that cannot be decoded is a std::runtime_error of the spinning function.
  std::uint64_t send(const Request& request, std::function<void(const Response&)> callback) const {
    return remote_->call(to_cdr(request), [context = context_, call = std::move(callback)](const Bytes& cdr) {
      context->run([&] {
        Response response;
        if (const Status status = from_cdr(std::span(cdr), response); !status)
          throw std::runtime_error("cannot decode a service response: " + status.why());
        call(response);
      });
    });
  }

  Context* context_ = nullptr;
  std::shared_ptr<RemoteService> remote_;
};

class DOPPEL_API Node {
 public:
  // "talker", or "arm" in the namespace "/left". Throws InputError for a name that is invalid in ROS 2.
  explicit Node(Context& context, std::string_view name, std::string_view name_space = "");
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  [[nodiscard]] const std::string& name() const { return node_->name(); }  // "/left/arm", after remapping
  [[nodiscard]] Context& context() const { return context_; }

  // -- topics
  template <Message M>
  Publisher<M> create_publisher(std::string_view topic, Qos qos = {}) {
    return Publisher<M>(context_, resolve(doppel::NameKind::topic, topic), node_->advertise<M>(topic, qos));
  }
  template <Message M>
  void create_subscription(std::string_view topic, std::function<void(const M&)> callback, Qos qos = {}) {
    node_->subscribe<M>(
        topic, [this, call = std::move(callback)](const M& m) { context_.run([&] { call(m); }); }, qos);
  }

  // -- time
  // ROS time: wall-clock time, or, with the parameter use_sim_time, the time of /clock (zero before
  // its first message).
  [[nodiscard]] Time now() const;
  // Timers run as long as the returned object exists.
  [[nodiscard]] std::shared_ptr<Timer> create_wall_timer(std::chrono::nanoseconds period,
                                                         std::function<void()> callback);
  [[nodiscard]] std::shared_ptr<Timer> create_timer(std::chrono::nanoseconds period,  // by now()
                                                    std::function<void()> callback);

  // -- services
  // An exception of the callback leaves the spinning function; the request then gets no response.
  template <Service S>
  void create_service(std::string_view service,
                      std::function<void(const typename S::Request&, typename S::Response&)> callback) {
    node_->serve<S>(service, [this, call = std::move(callback)](const typename S::Request& request,
                                                                Responder<typename S::Response> respond) {
      context_.run([&] {
        typename S::Response response;
        call(request, response);
        respond(response);
      });
    });
  }
  template <Service S>
  Client<S> create_client(std::string_view service) {
    const ServiceSupport& support = service_support<S>();
    return Client<S>(context_, make_client(resolve(doppel::NameKind::service, service), support));
  }

  // -- actions; their clients: action_client.h
  // A callback that throws refuses the goal.
  template <Action A>
  [[nodiscard]] std::unique_ptr<ActionServer<A>> create_action_server(
      std::string_view action, typename ActionServer<A>::Callbacks callbacks) {
    auto& [on_goal, on_cancel] = callbacks;
    if (on_goal) {
      on_goal = [this, call = std::move(on_goal)](const GoalId& id, const typename A::Goal& goal) {
        return decision_of([&] { return call(id, goal); });
      };
    }
    if (on_cancel) {
      on_cancel = [this, call = std::move(on_cancel)](const GoalId& id) {
        return decision_of([&] { return call(id); });
      };
    }
    return std::make_unique<ActionServer<A>>(*node_, action, std::move(callbacks));
  }

  // -- parameters, which others read and set by the node's services
  // The value of the command line or of a parameter file if there is one, else `initial`. Throws InputError
  // if its type does not match, std::logic_error if it is already declared. `T` is one of ParameterValue's.
  template <class T>
  T declare_parameter(const std::string& parameter, T initial, const std::string& description = "") {
    return std::get<T>(declare(parameter, ParameterValue(std::move(initial)), description));
  }
  // Throws std::logic_error if it is not declared or of another type.
  template <class T>
  [[nodiscard]] T get_parameter(std::string_view parameter) const {
    if (const T* value = std::get_if<T>(&value_of(parameter))) return *value;
    throw std::logic_error("parameter '" + std::string(parameter) + "' has another type");
  }
  Status set_parameter(std::string_view parameter, ParameterValue value) {
    return node_->parameters().set(parameter, std::move(value));
  }
  // Called after every change.
  void on_parameter_change(
      std::function<void(const std::string& name, const ParameterValue& value)> listener);

  // -- log: to stderr and on /rosout
  void info(const std::string& text, CodeLocation where = CodeLocation::current()) const {
    log(Severity::note, text, where);
  }
  void warn(const std::string& text, CodeLocation where = CodeLocation::current()) const {
    log(Severity::warning, text, where);
  }
  void error(const std::string& text, CodeLocation where = CodeLocation::current()) const {
    log(Severity::error, text, where);
  }

  // The node on the bus.
  [[nodiscard]] doppel::Node& on_bus() { return *node_; }

 private:
  template <class Call>
  Status decision_of(const Call& call) {
    Status decision = Status::refused("its callback threw an exception");
    context_.run([&] { decision = call(); });
    return decision;
  }
  [[nodiscard]] std::string resolve(doppel::NameKind kind, std::string_view name) const;
  ParameterValue declare(const std::string& name, ParameterValue initial, const std::string& description);
  [[nodiscard]] const ParameterValue& value_of(std::string_view parameter) const;
  std::shared_ptr<RemoteService> make_client(const std::string& service, const ServiceSupport& support);
  void log(Severity severity, const std::string& text, const CodeLocation& where) const;
  void follow_clock(bool use_sim_time);

  Context& context_;
  std::unique_ptr<doppel::Node> node_;
  ParameterOverrides overrides_;
  bool use_sim_time_ = false, has_clock_ = false;
  doppel::Publisher<rcl_interfaces::msg::Log> rosout_;
};

}  // namespace doppel::ros2
