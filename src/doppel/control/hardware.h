#pragma once
// ros2_control's idea of hardware as one small interface: a system offers named state and command interfaces
// ("Revolute 1/position"), each one double, and is read and written once in every tick of the controller
// manager. The simulated hardware and a servo bus implement the same one; use_sim chooses, nothing above it
// changes.

#include <span>
#include <string>
#include <vector>

#include "doppel/core/status.h"
#include "doppel/core/time.h"

namespace doppel {

inline constexpr const char* kPosition = "position";          // rad or m
inline constexpr const char* kVelocity = "velocity";          // rad/s or m/s
inline constexpr const char* kAcceleration = "acceleration";  // rad/s^2 or m/s^2
inline constexpr const char* kEffort = "effort";              // N m or N

struct InterfaceDescription {
  std::string prefix;  // joint, sensor or gpio name, spaces and all
  std::string name;    // "position"
  double initial = 0;  // NaN: none
  [[nodiscard]] std::string full_name() const { return prefix + "/" + name; }
};

class SystemInterface {
 public:
  virtual ~SystemInterface() = default;

  [[nodiscard]] virtual const std::string& name() const = 0;    // <ros2_control name>
  [[nodiscard]] virtual const std::string& plugin() const = 0;  // the plugin that the description named
  [[nodiscard]] virtual std::vector<InterfaceDescription> state_interfaces() const = 0;
  [[nodiscard]] virtual std::vector<InterfaceDescription> command_interfaces() const = 0;

  virtual Status activate() = 0;
  virtual Status deactivate() = 0;

  // Which command interfaces (by full name) a switch of controllers is about to claim and to release; a
  // refusal stops the switch. perform: between ticks, before the new controllers' first update. An unclaimed
  // joint is limp.
  virtual Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) = 0;
  virtual void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) = 0;

  // In the loop: fill `states` (in the order of state_interfaces()) and act on `commands` (order of
  // command_interfaces()). NaN in `commands`: no command yet. No allocation, no lock, no throw.
  virtual void read(Time now, Duration period, std::span<double> states) = 0;
  virtual void write(Time now, Duration period, std::span<const double> commands) = 0;
};

}  // namespace doppel
