#pragma once
// Emulated devices behind a pseudo-terminal, for the driver of another program: a thread serves the bytes
// in wall-clock time, the loop moves the joints. Its states are the joints' of the simulation. It has
// commands only for a hand that guides the arm (emulation_options.h).

#include <atomic>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/emulated_robot/engine_motors.h"
#include "doppel/devices/emulated_robot/stepped_device.h"
#include "doppel/devices/emulation/emulation_options.h"
#include "doppel/devices/emulation/fault_file.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/devices/serial/serial_ports.h"
#include "doppel/export.h"

namespace doppel {

class HandSweep;  // detail/hand_sweep.h

class DOPPEL_API EmulatedPort : public HardwareComponent, public SteppedDevice {
 public:
  EmulatedPort(Instance robot, const EmulationOptions& options);
  ~EmulatedPort() override;

  Status on_init(const HardwareInfo& info) override;
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override { return states_; }
  // The hand that guides the arm has some.
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override { return commands_; }
  Status on_configure() override;
  Status on_cleanup() override;
  [[nodiscard]] PassiveJoint when_unclaimed() const override { return PassiveJoint::free; }
  void on_stop() override {}  // the devices belong to the other program
  void on_stop_reset() override {}
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  HardwareReturn write(Time now, Duration period, std::span<const double> commands) override;
  void attend() override;
  void before_step() override;
  void rebind(Instance robot) override;

  // "/dev/pts/7"; empty before on_configure().
  [[nodiscard]] std::string path() const { return terminal_ != nullptr ? terminal_->name() : ""; }

 private:
  enum class Quantity { position, velocity, effort, other };
  struct Source {
    int joint = -1;
    Quantity quantity = Quantity::other;
  };
  void serve();
  void trace(char direction, std::span<const std::uint8_t> bytes, Time when);
  void stop_serving();

  Instance robot_;
  ServoSetup setup_;
  const Log* log_ = nullptr;
  const EmulationOptions options_;
  std::optional<FaultFile> faults_;
  std::vector<InterfaceDescription> states_, commands_;
  std::vector<Source> sources_;
  std::vector<std::size_t> guided_;  // joints of the setup, by the commands
  std::vector<double> hand_;         // positions of the hand, by the joints of the setup
  std::unique_ptr<HandSweep> sweep_;
  std::ofstream trace_;
  Time start_{};  // of the terminal's clock
  std::unique_ptr<EngineMotors> motors_;
  std::unique_ptr<PseudoTerminal> terminal_;
  std::unique_ptr<EmulatedPortNote> note_;  // for other programs
  std::mutex mutex_;                        // of devices_
  std::unique_ptr<DeviceEmulator> devices_;
  std::atomic<bool> ends_{false};
  std::thread server_;
};

// In place of the drivers of real servos: their devices, each behind a pseudo-terminal.
DOPPEL_API void register_emulated_ports(HardwareRegistry& registry, Instance robot,
                                        const EmulationOptions& options);

}  // namespace doppel
