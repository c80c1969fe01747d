#include "doppel/twin/mirror/detail/device_services.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "doppel/control/manager/controller_manager.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using doppel_msgs::srv::ConfirmPose;
using doppel_msgs::srv::GuideJoint;
using doppel_msgs::srv::ReleaseJoint;
using std_srvs::srv::Trigger;

template <class Response>
Response answer(const Status& status, const std::string& done) {
  Response out;
  out.success = status.ok();
  out.message = status ? done : status.why();
  return out;
}

// Those in one of two states.
std::vector<std::string> devices_that_are(const ControllerManager& manager, HardwareState a,
                                          HardwareState b) {
  std::vector<std::string> out;
  DeviceReport report;
  const std::vector<HardwareView> components = manager.hardware();
  for (std::size_t i = 0; i < components.size(); ++i) {
    const HardwareState state = components[i].state;
    if ((state == a || state == b) && manager.report(i, report)) out.push_back(components[i].name);
  }
  return out;
}

std::vector<std::string> commanding_controllers(const ControllerManager& manager) {
  std::vector<std::string> out;
  for (const ControllerView& one : manager.controllers()) {
    if (one.state == ControllerState::active && (!one.claimed.empty() || !one.required_commands.empty()))
      out.push_back(one.name);
  }
  return out;
}

}  // namespace

DeviceServices::DeviceServices(Node& node, TwinRobot& robot, std::vector<std::string>& resting, bool guided)
    : robot_(robot), resting_(resting) {
  node.serve<Trigger>("~/hardware/release", [this](const Trigger::Request&, const auto& respond) {
    respond(answer<Trigger::Response>(release(), "the torque is off; a hand moves the joints"));
  });
  node.serve<Trigger>("~/hardware/hold", [this](const Trigger::Request&, const auto& respond) {
    respond(answer<Trigger::Response>(hold(), "the joints hold where they are"));
  });
  node.serve<ConfirmPose>(
      "~/hardware/confirm_pose", [this](const ConfirmPose::Request& request, const auto& respond) {
        std::vector<std::pair<std::string, double>> pose;
        for (std::size_t i = 0; i < request.joints.size(); ++i)
          pose.emplace_back(request.joints[i],
                            i < request.positions.size() ? request.positions[i] : std::nan(""));
        respond(answer<ConfirmPose::Response>(
            robot_.controller_manager().confirm_pose(std::string(request.component), pose),
            "confirmed until the device loses its power"));
      });
  node.serve<ReleaseJoint>(
      "~/hardware/release_joint", [this](const ReleaseJoint::Request& request, const auto& respond) {
        respond(answer<ReleaseJoint::Response>(
            robot_.controller_manager().release_joint(
                {std::string(request.joint), request.duration, request.lower, request.upper, request.speed}),
            "the torque is off, until the time is over or the joint leaves its interval"));
      });
  if (!guided) return;
  node.serve<GuideJoint>("~/hardware/guide", [this](const GuideJoint::Request& request, const auto& respond) {
    const bool moves = robot_.guide(std::string(request.joint), request.position);
    respond(answer<GuideJoint::Response>(
        moves ? Status() : Status::refused(fmt::format("no device drives '{}'", std::string(request.joint))),
        ""));
  });
}

// A component that cannot be released holds again, and with it the others.
Status DeviceServices::release() {
  ControllerManager& manager = robot_.controller_manager();
  if (manager.is_stopped())
    return Status::refused("the emergency stop is active, and the joints hold; reset it first");
  const std::vector<std::string> components =
      devices_that_are(manager, HardwareState::active, HardwareState::active);
  if (components.empty()) return Status::refused("no device is active");
  std::vector<std::string> controllers = commanding_controllers(manager);
  if (!controllers.empty()) {
    const Status ended = manager.switch_controllers({}, controllers, Strictness::strict);
    if (!ended) return ended;
  }
  resting_ = std::move(controllers);
  for (const std::string& name : components) {
    const Status released = release_component(name);
    if (released) continue;
    const Status held = hold();
    return Status::refused(held ? released.why() : released.why() + "; " + held.why());
  }
  return {};
}

Status DeviceServices::release_component(const std::string& name) {
  ControllerManager& manager = robot_.controller_manager();
  const Status inactive = manager.set_hardware_state(name, HardwareState::inactive);
  if (!inactive) return inactive;
  return manager.relax_hardware(name);
}

Status DeviceServices::hold() {
  ControllerManager& manager = robot_.controller_manager();
  const std::vector<std::string> components =
      devices_that_are(manager, HardwareState::inactive, HardwareState::unconfigured);
  if (components.empty()) return Status::refused("no device is inactive");
  for (const std::string& name : components) {
    if (const Status active = manager.set_hardware_state(name, HardwareState::active); !active) return active;
  }
  const std::vector<std::string> controllers = std::exchange(resting_, {});
  if (controllers.empty() || manager.is_stopped()) return {};
  return manager.switch_controllers(controllers, {}, Strictness::strict);
}

}  // namespace doppel
