#pragma once
// Emulated devices behind a pseudo-terminal, for the driver of another program: a thread serves the bytes
// in wall-clock time, the loop moves the joints. It has no commands; its states are the joints' of the
// simulation.

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/emulated_robot/engine_motors.h"
#include "doppel/devices/emulated_robot/stepped_device.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API EmulatedPort : public HardwareComponent, public SteppedDevice {
 public:
  explicit EmulatedPort(Instance robot) : robot_(robot) {}
  ~EmulatedPort() override;

  Status on_init(const HardwareInfo& info) override;
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override { return states_; }
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override { return {}; }
  Status on_configure() override;
  Status on_cleanup() override;
  [[nodiscard]] PassiveJoint when_unclaimed() const override { return PassiveJoint::free; }
  void on_stop() override {}  // the devices belong to the other program
  void on_stop_reset() override {}
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  HardwareReturn write(Time /*now*/, Duration /*period*/, std::span<const double> /*commands*/) override {
    return HardwareReturn::ok;
  }
  void before_step() override;
  void rebind(Instance robot) override { robot_ = robot; }

  // "/dev/pts/7"; empty before on_configure().
  [[nodiscard]] std::string path() const { return terminal_ != nullptr ? terminal_->name() : ""; }

 private:
  enum class Quantity { position, velocity, effort, other };
  struct Source {
    int joint = -1;
    Quantity quantity = Quantity::other;
  };
  void serve();
  void stop_serving();

  Instance robot_;
  ServoSetup setup_;
  const Log* log_ = nullptr;
  std::vector<InterfaceDescription> states_;
  std::vector<Source> sources_;
  std::unique_ptr<EngineMotors> motors_;
  std::unique_ptr<PseudoTerminal> terminal_;
  std::mutex mutex_;  // of devices_
  std::unique_ptr<DeviceEmulator> devices_;
  std::atomic<bool> ends_{false};
  std::thread server_;
};

// In place of the drivers of real servos: their devices, each behind a pseudo-terminal.
DOPPEL_API void register_emulated_ports(HardwareRegistry& registry, Instance robot);

}  // namespace doppel
