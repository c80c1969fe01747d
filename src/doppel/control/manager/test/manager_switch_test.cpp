// Switching in all circumstances: random sequences preserve the invariants, handovers are smooth, hardware
// may be asynchronous.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using Names = std::vector<std::string>;

std::string groups(const std::vector<std::pair<std::string, std::string>>& joints_of,
                   const std::string& more = "") {
  std::string manager = "controller_manager:\n  ros__parameters:\n" + more, sections;
  for (const auto& [name, joints] : joints_of) {
    manager += "    " + name + ": {type: position_controllers/JointGroupPositionController}\n";
    sections += name + ": {ros__parameters: {joints: [" + joints + "]}}\n";
  }
  return manager + sections;
}

Names some_of(const Names& all, std::mt19937& random) {
  Names out;
  for (const std::string& name : all) {
    if (random() % 3 == 0) out.push_back(name);
  }
  std::shuffle(out.begin(), out.end(), random);
  return out;
}

// Every claimed command has exactly one active controller that requires it, and the hardware sees exactly
// these claims.
void expect_consistent(const ManagerRig& rig) {
  std::map<std::string, std::string> holders;
  for (const ControllerView& view : rig.manager->controllers()) {
    EXPECT_EQ(view.claimed.empty(), view.state != ControllerState::active) << view.name;
    for (const std::string& command : view.claimed)
      EXPECT_TRUE(holders.emplace(command, view.name).second) << command;
  }
  for (const InterfaceView& view : rig.manager->command_interfaces()) {
    EXPECT_EQ(view.claimed_by, holders.contains(view.full_name) ? holders[view.full_name] : "")
        << view.full_name;
    EXPECT_EQ(rig.hardware->claimed(view.full_name), !view.claimed_by.empty()) << view.full_name;
  }
}

TEST(ControllerSwitch, RandomSequenceKeepsClaimsExclusive) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    ManagerRig rig(
        groups({{"g0", "j0"}, {"g1", "j0, j1"}, {"g2", "j2"}, {"g3", "j1, j2"}, {"g4", "j0, j1, j2"}}),
        {{"j0"}, {"j1"}, {"j2"}});
    const Names all = {"g0", "g1", "g2", "g3", "g4"};
    for (const std::string& name : all) {
      rig.manager->load(name);
      if (random() % 5 != 0) {
        ASSERT_TRUE(rig.manager->configure(name).ok());
      }
    }
    for (int i = 0; i < 60; ++i) {
      const Names start = some_of(all, random), stop = some_of(all, random);
      const bool strict = random() % 2 == 0;
      rig.hardware->refuse_switch = random() % 8 == 0 ? "busy" : "";
      std::map<std::string, ControllerState> before;
      for (const std::string& name : all) before[name] = rig.state_of(name);
      const bool done =
          rig.manager->switch_controllers(start, stop, strict ? Strictness::strict : Strictness::best_effort)
              .ok();
      for (const std::string& name : all) {
        const bool started = std::find(start.begin(), start.end(), name) != start.end();
        const bool stopped = std::find(stop.begin(), stop.end(), name) != stop.end();
        if (!done || (!started && !stopped)) {
          EXPECT_EQ(rig.state_of(name), before[name]) << name;
        } else if (strict) {
          EXPECT_EQ(rig.state_of(name), started ? ControllerState::active : ControllerState::inactive)
              << name;
        }
      }
      expect_consistent(rig);
      rig.run(1);
    }
  }
}

TEST(ControllerSwitch, HandoverKeepsCommand) {
  ManagerRig rig(groups({{"one", "a"}, {"two", "a"}}));
  rig.start({"one"});
  rig.manager->load("two");
  ASSERT_TRUE(rig.manager->configure("two").ok());
  rig.say<std_msgs::msg::Float64MultiArray>("/one/commands", {{}, {0.75}});
  rig.run(2);
  rig.hardware->set_offset("a", -0.1);  // it sags
  ASSERT_TRUE(rig.switch_to({"two"}, {"one"}).ok());
  rig.run(1);
  EXPECT_EQ(rig.manager->command("a/position"), 0.75);
  ASSERT_TRUE(rig.switch_to({}, {"two"}).ok());
  rig.run(5);
  ASSERT_TRUE(rig.switch_to({"one"}).ok());
  rig.run(1);
  EXPECT_TRUE(std::isnan(rig.manager->command("a/position")));
}

TEST(ControllerSwitch, DeactivationZeroReachesHardware) {
  const std::string yaml =
      "controller_manager: {ros__parameters: {g: {type: "
      "velocity_controllers/JointGroupVelocityController}}}\n"
      "g: {ros__parameters: {joints: [a]}}\n";
  FakeHardwareOptions options;
  options.joints = {"a"};
  options.commands = {kVelocity};
  ManagerRig rig(yaml, {{"a"}}, options);
  rig.start({"g"});
  rig.say<std_msgs::msg::Float64MultiArray>("/g/commands", {{}, {0.75}});
  rig.run(2);
  ASSERT_EQ(rig.hardware->last_command("a/velocity"), 0.75);
  ASSERT_TRUE(rig.switch_to({}, {"g"}).ok());
  EXPECT_EQ(rig.hardware->command_at_release("a/velocity"), 0.0);
}

TEST(ControllerSwitch, HardwareThatFailsToActivateIsNotWritten) {
  ManagerRig rig("");
  const ParameterFile file = ParameterFile::parse(groups({{"g", "a"}}), "test.yaml");
  Bus bus;
  ControllerManager manager(bus, rig.model, rig.registry, &file, {}, rig.log, rig.diagnostics);
  FakeHardwareOptions options;
  options.joints = {"a"};
  auto fake = std::make_unique<FakeHardware>(options);
  fake->refuse_activation = "no power";
  FakeHardware& hardware = *fake;
  EXPECT_EQ(manager.add_hardware(std::move(fake), hardware.description(), rig.diagnostics).why(),
            "hardware 'FakeSystem' cannot be activated: no power");
  EXPECT_THAT(input_error_of([&] { manager.start(Names{"g"}); }),
              HasSubstr("its hardware 'FakeSystem' is inactive"));
  manager.tick(Time{});
  EXPECT_EQ(hardware.writes, 0);
}

TEST(ControllerSwitch, InitiallyInactiveHardwareStaysInactive) {
  ManagerRig rig(groups({{"g", "a"}}, "    hardware_components_initial_state: {inactive: [FakeSystem]}\n"));
  EXPECT_FALSE(rig.hardware->active);
  EXPECT_FALSE(rig.manager->command_interfaces()[0].available);
  EXPECT_TRUE(rig.manager->state_interfaces()[0].available);
}

TEST(ControllerSwitch, DuplicateInterfaceIsRefused) {
  ManagerRig rig("");
  FakeHardwareOptions options;
  options.name = "Other";
  options.joints = {"a"};
  auto other = std::make_unique<FakeHardware>(options);
  const HardwareDescription description = other->description();
  EXPECT_THAT(input_error_of([&] {
                static_cast<void>(rig.manager->add_hardware(std::move(other), description, rig.diagnostics));
              }),
              HasSubstr("the state interface 'a/position' of hardware 'Other' is already exported"));
}

}  // namespace
}  // namespace doppel
