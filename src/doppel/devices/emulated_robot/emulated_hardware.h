#pragma once
// The driver of real servos on an emulated bus, whose motors are the joints of a simulated robot: every
// byte that the driver sends and gets is that of the real bus, in simulated time, so that a run is
// repeatable.

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/devices/emulated_robot/engine_motors.h"
#include "doppel/devices/emulated_robot/stepped_device.h"
#include "doppel/devices/emulation/emulated_link.h"
#include "doppel/devices/emulation/emulation_options.h"
#include "doppel/devices/emulation/fault_file.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class DOPPEL_API EmulatedHardware : public ServoHardware, public SteppedDevice {
 public:
  EmulatedHardware(Instance robot, const EmulationOptions& options);

  Status on_init(const HardwareInfo& info) override;
  Status on_activate() override;
  Status on_deactivate() override;
  Status on_error() override;
  void on_stop() override;
  Status relax() override;
  Status release_joint(const JointRelease& release) override;
  Status confirm_pose(std::span<const std::pair<std::string, double>> positions) override;
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  void attend() override;

  void before_step() override;
  bool guide(std::string_view joint, double position) override;
  void rebind(Instance robot) override;
  // nullptr before on_init().
  [[nodiscard]] DeviceEmulator* devices() { return devices_.get(); }

 private:
  void follow_time();

  Instance robot_;
  std::unique_ptr<DeviceEmulator> devices_;
  std::unique_ptr<EngineMotors> motors_;
  EmulatedLink* link_ = nullptr;  // the driver's
  EmulationOptions options_;
  std::optional<FaultFile> faults_;
  const Log* log_ = nullptr;
};

// In place of the drivers of real servos: the same ones on emulated buses.
DOPPEL_API void register_emulated_hardware(HardwareRegistry& registry, Instance robot,
                                           const EmulationOptions& options);

}  // namespace doppel
