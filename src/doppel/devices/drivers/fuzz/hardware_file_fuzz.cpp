// Fuzz target: config/hardware.yaml of an arm of two servos.
#include <cstdint>
#include <cstdlib>

#include "doppel/base/core/fuzz/input_file.h"
#include "doppel/description/urdf/load.h"
#include "doppel/devices/drivers/servo_setup.h"

namespace {

constexpr const char* kArm = R"(<robot name="two"><link name="l0"/><link name="l1"/><link name="l2"/>
<joint name="j1" type="revolute"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="4"/></joint>
<joint name="j2" type="prismatic"><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
<limit lower="0" upper="0.1" effort="1" velocity="4"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>doppel/FeetechSts</plugin></hardware>
<joint name="j1"><param name="id">1</param><command_interface name="position"/></joint>
<joint name="j2"><param name="id">2</param><command_interface name="position"/></joint>
</ros2_control></robot>)";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::filesystem::path folder = doppel::fuzz_file("hardware.yaml", data, size).parent_path();
  doppel::Diagnostics diagnostics;
  static doppel::PackageResolver packages;
  static const doppel::RobotDescription robot =
      doppel::parse_urdf(kArm, (folder / "arm.urdf").string(), packages, diagnostics);
  static const doppel::Model model = doppel::compile_model(robot, doppel::BaseKind::fixed, diagnostics);
  try {
    const doppel::ServoSetup setup = doppel::read_servo_setup(robot.hardware.front(), model, diagnostics);
    if (setup.joints.size() != 2 || setup.file.empty()) std::abort();
  } catch (const doppel::InputError& error) {
    if (error.diagnostics().empty()) std::abort();
  }
  return 0;
}
