#include "servo_rig.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/description/urdf/load.h"
#include "doppel/physics/contract/engine_modules.h"

namespace doppel::bench {

std::string arm_description(const std::string& plugin, const std::string& params) {
  std::string out = R"(<robot name="arm"><link name="world"/>)";
  std::string joints;
  for (std::size_t i = 1; i <= kArmJoints; ++i) {
    out += fmt::format(
        R"(<link name="l{0}"><inertial><origin xyz="0.04 0 0"/><mass value="0.08"/>
<inertia ixx="2e-5" iyy="5e-5" izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{0}" type="revolute"><parent link="{1}"/><child link="l{0}"/><origin xyz="{2}"/>
<axis xyz="{3}"/><limit lower="-1.9" upper="1.9" effort="1.9" velocity="{4}"/>
<dynamics damping="0.05" friction="0.02"/></joint>)",
        i, i == 1 ? "world" : fmt::format("l{}", i - 1), i == 1 ? "0 0 0.6" : "0.08 0 0",
        i % 2 == 1 ? "0 0 1" : "0 -1 0", kArmSpeed);
    joints += fmt::format(
        R"(<joint name="j{0}"><param name="id">{0}</param><param name="offset_deg">0</param>
<command_interface name="position"/><state_interface name="position"/></joint>)",
        i);
  }
  return out + R"(<ros2_control name="Arm" type="system"><hardware><plugin>)" + plugin + "</plugin>" +
         params + "</hardware>" + joints + "</ros2_control></robot>";
}

void require(const Status& status) {
  if (!status) throw std::runtime_error(status.why());
}

ServoRig::ServoRig(const std::string& plugin, const std::string& params) {
  PackageResolver packages;
  description = std::make_shared<const RobotDescription>(
      parse_urdf(arm_description(plugin, params), "arm.urdf", packages, diagnostics));
  model = std::make_shared<const Model>(compile_model(*description, BaseKind::fixed, diagnostics));
  World world;
  world.ground = false;
  world.step = Duration{1'000'000};
  CollisionMeshes meshes;
  std::vector<ModelInstance> instances{make_instance(description, model, {}, meshes, diagnostics)};
  engine = compile_world(kDefaultEngine, world, std::move(instances), diagnostics)->make_engine();
}

void ServoRig::place(std::span<const double> q) {
  const std::vector<double> still(q.size());
  engine->instance(0).set_state(q, still);
  driver = std::make_unique<EmulatedHardware>(engine->instance(0), EmulationOptions{});
  const HardwareInfo info{description->hardware.front(), *model, log, 1 / to_seconds(kPeriod), diagnostics};
  require(driver->on_init(info));
}

Status ServoRig::start() {
  if (const Status configured = driver->on_configure(); !configured) return configured;
  if (const Status activated = driver->on_activate(); !activated) return activated;
  states.assign(driver->state_interfaces().size(), 0);
  command.assign(kArmJoints, std::numeric_limits<double>::quiet_NaN());
  std::vector<std::string> names;
  for (const InterfaceDescription& one : driver->command_interfaces()) names.push_back(one.full_name());
  driver->perform_switch(names, {});
  return {};
}

HardwareReturn ServoRig::cycle() {
  const Duration step = engine->world().settings().step;
  for (Duration passed{}; passed < kPeriod; passed += step) {
    driver->before_step();
    engine->step();
  }
  const HardwareReturn answer = driver->read(engine->time(), kPeriod, states);
  return answer == HardwareReturn::ok ? driver->write(engine->time(), kPeriod, command) : answer;
}

double ServoRig::goal(std::size_t joint) {
  const RegisterServo& servo = bus().servos()[joint];
  return servo.model().angle(servo.value(ServoRole::goal_position));
}

}  // namespace doppel::bench
