// The controller manager's /diagnostics, under ros2_control's names. One message is filled again and again,
// so that publishing does not allocate.

#include <fmt/format.h>

#include "doppel/control/manager/detail/controller_manager.h"

namespace doppel {
namespace {

using diagnostic_msgs::msg::DiagnosticStatus;
constexpr Duration kPeriod = std::chrono::seconds(1);
constexpr double kPoorRate = 0.9;  // of the desired rate: below it the loop is too slow

// Fills a status's values from the first; values of an earlier message that remain are removed.
class Values {
 public:
  explicit Values(DiagnosticStatus& status) : values_(status.values) {}
  ~Values() { values_.resize(count_); }
  Values(const Values&) = delete;
  Values& operator=(const Values&) = delete;

  void add(std::string_view key, std::string_view value) {
    if (count_ == values_.size()) values_.emplace_back();
    values_[count_].key.assign(key);
    values_[count_++].value.assign(value);
  }

 private:
  std::vector<diagnostic_msgs::msg::KeyValue>& values_;
  std::size_t count_ = 0;
};

}  // namespace

void ControllerManager::Impl::serve_diagnostics() {
  diagnostics_topic = node.advertise<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", {.depth = 1});
  for (const char* what :
       {"Controllers Activity", "Hardware Components Activity", "Controller Manager Activity"}) {
    DiagnosticStatus& status = diagnostics_message.status.emplace_back();
    status.name = fmt::format("{}: {}", options.name, what);
    status.hardware_id = "ros2_control";
  }
}

void ControllerManager::Impl::describe_controllers(DiagnosticStatus& status) const {
  Values values(status);
  bool all = true;
  for (const auto& c : loaded) {
    values.add(c->name, to_string(c->state));
    all = all && c->state == ControllerState::active;
  }
  status.level = all ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  status.message = loaded.empty() ? "No controllers are currently loaded!"
                   : all          ? "All controllers are active"
                                  : "Not all controllers are active";
}

void ControllerManager::Impl::describe_hardware(DiagnosticStatus& status) const {
  Values values(status);
  bool all = true, failed = false, finite = true;
  for (const auto& c : resources.components()) {
    values.add(c->name, to_string(c->state));
    if (!c->why.empty()) values.add(c->name + " fault", c->why);
    all = all && c->state == HardwareState::active;
    failed = failed || !c->why.empty();
    if (c->state != HardwareState::active || !c->not_finite) continue;
    values.add(c->name + " not finite", c->state_names[*c->not_finite]);
    finite = false;
  }
  const bool none = resources.components().empty();
  status.level = none || failed  ? DiagnosticStatus::ERROR
                 : all && finite ? DiagnosticStatus::OK
                                 : DiagnosticStatus::WARN;
  status.message = none      ? "No hardware components are loaded!"
                   : !finite ? "A joint's state is not finite"
                   : all     ? "All hardware components are active"
                             : "Not all hardware components are active";
}

void ControllerManager::Impl::describe_manager(DiagnosticStatus& status) const {
  Values values(status);
  values.add("update_rate", fmt::format("{:g}", rate_of(period)));
  values.add("emergency stop", stopped ? "on" : "off");
  bool poor = false;
  if (loop) {
    values.add("periodicity.average", fmt::format("{:.3f}", loop->rate));
    values.add("periodicity.standard_deviation", fmt::format("{:.3f}", loop->rate_deviation));
    values.add("execution_time.average", fmt::format("{:.1f}", loop->execution * 1e6));
    values.add("execution_time.max", fmt::format("{:.1f}", loop->longest * 1e6));
    values.add("lateness.p50", fmt::format("{:.1f}", loop->lateness.percentile(0.5)));
    values.add("lateness.p99", fmt::format("{:.1f}", loop->lateness.percentile(0.99)));
    values.add("lateness.max", fmt::format("{:.1f}", loop->lateness.worst()));
    values.add("overruns", fmt::format("{}", loop->overruns));
    poor = loop->rate < kPoorRate * rate_of(period);
  }
  status.level = stopped || poor ? DiagnosticStatus::WARN : DiagnosticStatus::OK;
  status.message = stopped ? "The emergency stop is on"
                   : poor  ? "Controller Manager has bad periodicity"
                           : "Controller Manager has good periodicity";
}

void ControllerManager::Impl::publish_diagnostics() {
  if (now < next_diagnostics && next_diagnostics - now <= kPeriod) return;  // more: time was set back
  next_diagnostics = now + kPeriod;
  if (!diagnostics_topic.has_listeners()) return;
  describe_controllers(diagnostics_message.status[0]);
  describe_hardware(diagnostics_message.status[1]);
  describe_manager(diagnostics_message.status[2]);
  diagnostics_message.header.stamp = to_time_msg(bus.ros_now());
  diagnostics_topic.publish(diagnostics_message, bus.now());
}

}  // namespace doppel
