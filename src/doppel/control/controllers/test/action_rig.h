#pragma once
// A controller with an action, and a client of it that uses the interfaces of external clients.

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/bus/action_server.h"

namespace doppel {

template <Action A>
class ActionRig : public ManagerRig {
 public:
  // action: "/arm/follow_joint_trajectory".
  ActionRig(const std::string& yaml, std::string action, const std::vector<FakeJoint>& joints,
            const FakeHardwareOptions& hardware_options, bool enforce_limits = false,
            CommandGuard* guard = nullptr)
      : ManagerRig(yaml, joints, hardware_options, manager_options(enforce_limits, guard)),
        action_(std::move(action)),
        client_(bus.attach("client")) {}
  ~ActionRig() { client_.reset(); }

  void run_for(double seconds) {
    run(static_cast<int>(std::lround(seconds / to_seconds(manager->period()))));
  }
  [[nodiscard]] double time() const { return to_seconds(now); }
  [[nodiscard]] double command(const std::string& full_name) const {
    return hardware->last_command(full_name);
  }

  struct Answer {
    std::optional<bool> accepted;
    std::optional<double> finished_at;  // s
    GoalStatus status = GoalStatus::unknown;
    typename A::Result result;
  };
  // The goal's index in `answers`.
  std::size_t send(const typename A::Goal& goal) {
    const std::size_t index = answers.size();
    answers.emplace_back();
    const GoalId id = id_of(index);
    call_action<SendGoal<A>>("send_goal", {{id}, goal},
                             [this, index](const auto& r) { answers[index].accepted = r.accepted; });
    if (!answers[index].accepted.value_or(false)) return index;
    call_action<GetResult<A>>("get_result", {{id}}, [this, index](const auto& r) {
      answers[index].finished_at = time();
      answers[index].status = static_cast<GoalStatus>(r.status);
      answers[index].result = r.result;
    });
    return index;
  }
  void cancel(std::size_t index) {
    call_action<action_msgs::srv::CancelGoal>("cancel_goal", {{{id_of(index)}, {}}}, [](const auto&) {});
  }
  static GoalId id_of(std::size_t index) { return {static_cast<std::uint8_t>(index + 1)}; }
  // The reply may come later than the call.
  template <class S>
  void call_service(const std::string& service, const typename S::Request& request,
                    std::function<void(const typename S::Response&)> reply) {
    client_->call(service, to_cdr(request), [reply](const Status& status, const Bytes& bytes) {
      require(status);
      typename S::Response response;
      require(from_cdr(bytes, response));
      reply(response);
    });
    bus.set_now(now);
    bus.spin();
  }
  Status set_parameter(const std::string& node, const std::string& name, const ParameterValue& value) {
    Status outcome = Status::refused("no answer");
    client_->set_parameter(node, name, value, [&](const Status& status) { outcome = status; });
    bus.spin();
    return outcome;
  }
  static void require(const Status& status) {
    if (!status) throw std::runtime_error(status.why());
  }

  std::vector<Answer> answers;

 private:
  static ControllerManagerOptions manager_options(bool enforce_limits, CommandGuard* guard) {
    ControllerManagerOptions out;
    out.enforce_limits = enforce_limits;
    out.guard = guard;
    return out;
  }
  template <class S, class Reply>
  void call_action(const std::string& service, const typename S::Request& request, Reply reply) {
    call_service<S>(action_ + "/_action/" + service, request, reply);
  }

  std::string action_;
  std::unique_ptr<Edge> client_;
};

}  // namespace doppel
