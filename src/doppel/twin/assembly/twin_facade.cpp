#include <fmt/format.h>

#include <memory>

#include "doppel/base/core/installation.h"
#include "doppel/base/core/names.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

Scenario single_robot(const std::string& target, const XacroArguments& arguments) {
  Scenario scenario;
  scenario.robots = {{.target = target, .arguments = arguments}};
  scenario.bundled_robots = data_folder() / "robots";
  return scenario;
}

const Log& quiet_log() {
  static const Log log;
  return log;
}

}  // namespace

Twin::Twin(const std::string& target, const XacroArguments& arguments)
    : Twin(single_robot(target, arguments), quiet_log(), *std::make_unique<Diagnostics>()) {}

void Twin::run_for(Duration time) {
  const Time end = now() + time;
  while (now() + step_size() / 2 < end && !diverged()) {
    between_steps();
    step();
  }
  between_steps();
}

JointHandle Twin::joint(std::string_view name) {
  const Model& model = robot().model();
  const int joint = model.find_joint(name);
  if (joint < 0 || !model.joints[static_cast<std::size_t>(joint)].scalar())
    throw InputError("twin.unknown_joint", {},
                     fmt::format("'{}' has no joint '{}' with one degree of freedom{}", robot().name(), name,
                                 did_you_mean(name, model.scalar_joint_names())));
  return {robot().instance(), joint};
}

const ModelJoint& JointHandle::model() const {
  return robot_.model().joints[static_cast<std::size_t>(joint_)];
}

double JointHandle::q() const {
  return robot_.q()[static_cast<std::size_t>(model().q)];
}

double JointHandle::v() const {
  return robot_.v()[static_cast<std::size_t>(model().v)];
}

double JointHandle::effort() const {
  return robot_.drive_effort()[static_cast<std::size_t>(joint_)];
}

void JointHandle::command(double position) {
  if (model().mimics())
    throw InputError("twin.mimic_commanded", {},
                     fmt::format("'{}' mimics another joint and has no drive", model().name),
                     "command the joint that it follows");
  if (robot_.drive(joint_) != DriveMode::position) robot_.set_drive(joint_, DriveMode::position);
  robot_.set_target(joint_, position);
}

}  // namespace doppel
