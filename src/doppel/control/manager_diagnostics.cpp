// What the controller manager says on /diagnostics, under ros2_control's names.

#include <fmt/format.h>

#include "doppel/control/controller_manager_detail.h"

namespace doppel {
namespace {

using diagnostic_msgs::msg::DiagnosticStatus;
constexpr Duration kPeriod = std::chrono::seconds(1);
constexpr double kPoorRate = 0.9;  // of the wanted one: below it the loop does not keep its time

DiagnosticStatus status_of(const std::string& manager, const char* what) {
  DiagnosticStatus out;
  out.name = fmt::format("{}: {}", manager, what);
  out.hardware_id = "ros2_control";
  return out;
}

}  // namespace

void ControllerManager::Impl::serve_diagnostics() {
  diagnostics_topic = node.advertise<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", {.depth = 1});
}

void ControllerManager::Impl::publish_diagnostics() {
  if (now < next_diagnostics && next_diagnostics - now <= kPeriod) return;  // further: time was set back
  next_diagnostics = now + kPeriod;
  if (!diagnostics_topic.has_listeners()) return;
  DiagnosticStatus controllers = status_of(options.name, "Controllers Activity");
  bool all = true;
  for (const auto& c : loaded) {
    controllers.values.push_back({c->name, std::string(to_string(c->state))});
    all = all && c->state == ControllerState::active;
  }
  controllers.level = all ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  controllers.message = loaded.empty() ? "No controllers are currently loaded!"
                        : all          ? "All controllers are active"
                                       : "Not all controllers are active";

  DiagnosticStatus hardware = status_of(options.name, "Hardware Components Activity");
  bool failed = false;
  all = true;
  for (const auto& c : resources.components()) {
    hardware.values.push_back({c->name, std::string(to_string(c->state))});
    if (!c->why.empty()) hardware.values.push_back({c->name + " fault", c->why});
    all = all && c->state == HardwareState::active;
    failed = failed || !c->why.empty();
  }
  const bool none = resources.components().empty();
  hardware.level = none || failed ? DiagnosticStatus::ERROR
                   : all          ? DiagnosticStatus::OK
                                  : DiagnosticStatus::WARN;
  hardware.message = none  ? "No hardware components are loaded!"
                     : all ? "All hardware components are active"
                           : "Not all hardware components are active";

  DiagnosticStatus manager = status_of(options.name, "Controller Manager Activity");
  manager.values.push_back({"update_rate", fmt::format("{:g}", rate_of(period))});
  manager.values.push_back({"emergency stop", stopped ? "on" : "off"});
  manager.message = "Controller Manager has good periodicity";
  if (loop) {
    manager.values.push_back({"periodicity.average", fmt::format("{:.3f}", loop->rate)});
    manager.values.push_back({"periodicity.standard_deviation", fmt::format("{:.3f}", loop->rate_deviation)});
    manager.values.push_back({"execution_time.average", fmt::format("{:.1f}", loop->execution * 1e6)});
    manager.values.push_back({"execution_time.max", fmt::format("{:.1f}", loop->longest * 1e6)});
    manager.values.push_back({"overruns", fmt::format("{}", loop->overruns)});
    if (loop->rate < kPoorRate * rate_of(period)) {
      manager.level = DiagnosticStatus::WARN;
      manager.message = "Controller Manager has bad periodicity";
    }
  }
  if (stopped) {
    manager.level = DiagnosticStatus::WARN;
    manager.message = "The emergency stop is on";
  }
  diagnostic_msgs::msg::DiagnosticArray message;
  message.header.stamp = to_time_msg(bus.ros_now());
  message.status = {std::move(controllers), std::move(hardware), std::move(manager)};
  diagnostics_topic.publish(message, bus.now());
}

}  // namespace doppel
