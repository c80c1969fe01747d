#pragma once
// ros2_control's hardware: a component (a system, an actuator or a sensor) offers named state and command
// interfaces ("Revolute 1/position"), each one double, and is read and written by the controller manager. Its
// life cycle is ros2_control's:
//
//   on_init -> unconfigured -- on_configure -> inactive -- on_activate -> active
//                           <- on_cleanup --            <- on_deactivate --
//   an error of any of them, of read() or of write(): on_error -> unconfigured, or finalized where it refuses
//   on_shutdown, from every state but finalized: -> finalized
//
// The simulated robot, a loopback and a servo bus implement the same contract; nothing above it changes.
// An exception that leaves a component counts as an error of that component.
//
// To add one from outside, build a shared library against these headers and end its source with
//   DOPPEL_EXPORT_HARDWARE(my_package::MyHardware, "my_package/MyHardware")   (hardware_registry.h)

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/core/log.h"
#include "doppel/core/status.h"
#include "doppel/core/time.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/kinematics/model.h"

namespace doppel {

inline constexpr const char* kPosition = "position";          // rad or m
inline constexpr const char* kVelocity = "velocity";          // rad/s or m/s
inline constexpr const char* kAcceleration = "acceleration";  // rad/s^2 or m/s^2
inline constexpr const char* kEffort = "effort";              // N m or N

struct DOPPEL_API InterfaceDescription {
  std::string prefix;  // joint, sensor or gpio name, spaces and all
  std::string name;    // "position"
  double initial = 0;  // a state's value before the first read; a command's before the first one: NaN none
  [[nodiscard]] std::string full_name() const { return prefix + "/" + name; }
};

enum class HardwareState { unconfigured, inactive, active, finalized };
DOPPEL_API std::string_view to_string(HardwareState state);

// What read() and write() answer. error: on_error runs; deactivate: on_deactivate runs and the component is
// inactive. In both cases the controllers that use it are deactivated and their fallback controllers started.
enum class HardwareReturn { ok, error, deactivate };

// What a joint does that nothing commands.
enum class PassiveJoint {
  free,   // it moves as it is pushed
  hold,   // a drive holds it where it is
  brake,  // its speed is held at zero
};
DOPPEL_API std::string_view to_string(PassiveJoint passive);

// What a component is given; valid during on_init only, but for what it points to.
struct HardwareInfo {
  const HardwareDescription& description;  // <ros2_control>, every part with its place
  const Model& model;                      // outlives the component
  const Log& log;                          // outlives the component
  double rw_rate = 0;                      // Hz, at which it will really be read and written
  Diagnostics& diagnostics;                // for warnings and notes about the description
};

class DOPPEL_API HardwareComponent {
 public:
  virtual ~HardwareComponent() = default;

  // Checks the description and its parameters. What is wrong in them is thrown as InputError with its place.
  virtual Status on_init(const HardwareInfo& info) = 0;
  [[nodiscard]] virtual std::vector<InterfaceDescription> state_interfaces() const = 0;    // after on_init
  [[nodiscard]] virtual std::vector<InterfaceDescription> command_interfaces() const = 0;  // after on_init

  // Between ticks. A refusal leaves the state as it was; an exception is an error.
  virtual Status on_configure() { return {}; }   // opens ports, reads what the device is
  virtual Status on_activate() { return {}; }    // from here on it is written
  virtual Status on_deactivate() { return {}; }  // its joints are passive
  virtual Status on_cleanup() { return {}; }     // closes what on_configure has opened
  virtual Status on_shutdown() { return {}; }
  // After an error: leaves the device as after on_cleanup. Refused: it cannot, and the component is
  // finalized.
  virtual Status on_error() { return {}; }

  // Which command interfaces (by full name) a switch of controllers is about to claim and to release; a
  // refusal stops the switch. perform: between ticks, before the new controllers' first update.
  virtual Status prepare_switch(std::span<const std::string> /*start*/,
                                std::span<const std::string> /*stop*/) {
    return {};
  }
  virtual void perform_switch(std::span<const std::string> /*start*/, std::span<const std::string> /*stop*/) {
  }

  // What its joints do that no controller claims, and what they do after an error.
  [[nodiscard]] virtual PassiveJoint when_unclaimed() const = 0;
  [[nodiscard]] virtual PassiveJoint when_failed() const { return when_unclaimed(); }

  // The emergency stop: every joint comes to rest and stays there, whatever was commanded; write() is not
  // called until on_stop_reset(). Between ticks.
  virtual void on_stop() = 0;
  virtual void on_stop_reset() = 0;

  // In the loop: fill `states` (in the order of state_interfaces()) and act on `commands` (order of
  // command_interfaces()). NaN in `commands`: no command yet. No allocation, no lock, no throw. read() is
  // called while inactive or active, write() while active.
  virtual HardwareReturn read(Time now, Duration period, std::span<double> states) = 0;
  virtual HardwareReturn write(Time now, Duration period, std::span<const double> commands) = 0;
  // The loop has not come by for longer than it may (control_loop.h): called once, from another thread, while
  // read() or write() may be under way. Brings the joints to rest as far as the device can by itself;
  // on_stop() follows when the loop continues.
  virtual void on_stall() noexcept {}
  // Why the last read() or write() did not answer ok, as a sentence's end; asked between ticks.
  [[nodiscard]] virtual std::string fault() const { return "no reason given"; }
};

}  // namespace doppel
