#pragma once
// An arm of six joints whose servos are emulated, with its driver, in simulated time and without controllers:
// for measurements of the driver.

#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/log.h"
#include "doppel/devices/emulated_robot/emulated_hardware.h"
#include "doppel/devices/emulation/bus_emulator.h"
#include "doppel/physics/contract/engine.h"

namespace doppel::bench {

inline constexpr std::size_t kArmJoints = 6;
inline constexpr double kArmSpeed = 4;  // rad/s, of every joint

// URDF. Links of 8 cm and 80 g, axes in turn vertical and horizontal. `params`: of <hardware>.
[[nodiscard]] std::string arm_description(const std::string& plugin, const std::string& params);

// Throws std::runtime_error with the reason of a refusal.
void require(const Status& status);

class ServoRig {
 public:
  static constexpr Duration kPeriod{10'000'000};  // of the driver's cycle

  explicit ServoRig(const std::string& plugin,
                    const std::string& params = "<param name=\"gentle\">never</param>");

  // The joints are at `q`, at rest, and the devices measure it. Before start().
  void place(std::span<const double> q);
  // Configures and activates the driver. Refused: why.
  Status start();
  // One cycle: physics, read, write with `command`.
  HardwareReturn cycle();

  [[nodiscard]] double q(std::size_t joint) const { return robot().q()[joint]; }
  [[nodiscard]] double v(std::size_t joint) const { return robot().v()[joint]; }
  [[nodiscard]] const Instance robot() const { return engine->instance(0); }
  [[nodiscard]] BusEmulator& bus() { return dynamic_cast<BusEmulator&>(*driver->devices()); }
  // The goal in the register of a servo, as the joint's position.
  [[nodiscard]] double goal(std::size_t joint);

  Log log;
  Diagnostics diagnostics;
  std::shared_ptr<const RobotDescription> description;
  std::shared_ptr<const Model> model;
  std::unique_ptr<Engine> engine;
  std::unique_ptr<EmulatedHardware> driver;
  std::vector<double> states, command;
};

}  // namespace doppel::bench
