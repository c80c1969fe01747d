#pragma once
// ros2_control's hardware: a component (a system, an actuator or a sensor) exports named state and command
// interfaces ("Revolute 1/position"), each one double, and is read and written by the controller manager. Its
// life cycle is ros2_control's:
//
//   on_init -> unconfigured -- on_configure -> inactive -- on_activate -> active
//                           <- on_cleanup --            <- on_deactivate --
//   an error of any of them, of read() or of write(): on_error -> unconfigured, or finalized where it refuses
//   on_shutdown, from every state but finalized: -> finalized
//
// The simulated robot, a loopback and a servo bus implement the same contract. An exception that leaves a
// component is an error of that component. All functions but on_stall() are called by one thread at a time.
//
// For a component outside the tree, build a shared library against these headers and end its source with
//   DOPPEL_EXPORT_HARDWARE(my_package::MyHardware, "my_package/MyHardware")   (hardware_registry.h)

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/log.h"
#include "doppel/base/core/saved_part.h"
#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

inline constexpr const char* kPosition = "position";          // rad or m
inline constexpr const char* kVelocity = "velocity";          // rad/s or m/s
inline constexpr const char* kAcceleration = "acceleration";  // rad/s^2 or m/s^2
inline constexpr const char* kEffort = "effort";              // N m or N

struct DOPPEL_API InterfaceDescription {
  std::string prefix;  // joint, sensor or gpio name, which may contain spaces
  std::string name;    // "position"
  double initial = 0;  // value of a state before the first read, or of a command before the first one (NaN)
  [[nodiscard]] std::string full_name() const { return prefix + "/" + name; }
};

enum class HardwareState { unconfigured, inactive, active, finalized };
DOPPEL_API std::string_view to_string(HardwareState state);

// Result of read() and write(). error: on_error is called; deactivate: on_deactivate is called and
// the component is inactive. In both cases the controllers that use it are deactivated and their
// fallback controllers started.
enum class HardwareReturn { ok, error, deactivate };

// How a device is, for people: its state in a word, and each of its joints. NaN: not measured.
struct DeviceReport {
  struct Joint {
    std::string name;
    int id = 0;                                        // on its bus
    double position = 0, goal = 0;                     // rad or m
    double velocity = 0;                               // per s
    double load = 0;                                   // share of the stall torque
    double current = 0, voltage = 0, temperature = 0;  // A, V, degrees Celsius
    double age = 0;                                    // s since its last answer
    bool believed = false;  // the position is what the device was told, and no measurement
    std::string faults;     // "overload, temperature"; empty: none
    // The last short release of its torque, see JointRelease; torque_on: 0 while it lasts.
    bool released = false;
    Time torque_off{}, torque_on{};
  };
  std::string state;  // "holding"; "unconfirmed": see HardwareComponent::confirm_pose()
  std::string port;
  std::vector<Joint> joints;
  std::uint64_t cycles = 0, lost = 0, damaged = 0;  // answers
};

// The torque of one joint off for a short time, while the others hold. It is on again after `duration`, and
// before where the joint leaves the interval or becomes faster.
struct JointRelease {
  std::string joint;
  double duration = 0;          // s, at most kMaxRelease
  double lower = 0, upper = 0;  // rad or m, within the joint's limits
  double speed = 0;             // rad/s or m/s, at most the joint's limit
};
inline constexpr double kMaxRelease = 2.0;  // s
// rad or m: a joint that was caught follows commands again from the first one that is this near to it.
inline constexpr double kRejoin = 0.05;

// The behaviour of a joint without commands.
enum class PassiveJoint {
  free,   // it moves freely under external loads
  hold,   // a drive holds its position
  brake,  // its velocity is held at zero
};
DOPPEL_API std::string_view to_string(PassiveJoint passive);

// The environment of a component; valid during on_init only, except for the objects that
// outlive the component.
struct HardwareInfo {
  const HardwareDescription& description;  // <ros2_control>, every part with its place
  const Model& model;                      // outlives the component
  const Log& log;                          // outlives the component
  double rw_rate = 0;                      // Hz of read() and write(), rounded to the manager's period
  Diagnostics& diagnostics;                // for warnings and notes about the description
};

class DOPPEL_API HardwareComponent {
 public:
  virtual ~HardwareComponent() = default;

  // Checks the description and its parameters. Throws InputError with the place of an error.
  virtual Status on_init(const HardwareInfo& info) = 0;
  [[nodiscard]] virtual std::vector<InterfaceDescription> state_interfaces() const = 0;    // after on_init
  [[nodiscard]] virtual std::vector<InterfaceDescription> command_interfaces() const = 0;  // after on_init

  // Between ticks. A refusal leaves the state as it was; an exception is an error.
  virtual Status on_configure() { return {}; }   // opens ports, identifies the device
  virtual Status on_activate() { return {}; }    // afterwards write() is called
  virtual Status on_deactivate() { return {}; }  // its joints are passive
  virtual Status on_cleanup() { return {}; }     // closes what on_configure has opened
  virtual Status on_shutdown() { return {}; }
  // After an error: leaves the device as after on_cleanup. A refusal means that it cannot, and the
  // component is finalized.
  virtual Status on_error() { return {}; }

  // The command interfaces (full names) that a switch of controllers is about to claim and to release; a
  // refusal cancels the switch. perform: between ticks, before the new controllers' first update.
  virtual Status prepare_switch(std::span<const std::string> /*start*/,
                                std::span<const std::string> /*stop*/) {
    return {};
  }
  virtual void perform_switch(std::span<const std::string> /*start*/, std::span<const std::string> /*stop*/) {
  }

  // The behaviour of joints that no controller claims, and of all joints after an error.
  [[nodiscard]] virtual PassiveJoint when_unclaimed() const = 0;
  [[nodiscard]] virtual PassiveJoint when_failed() const { return when_unclaimed(); }

  // The emergency stop, between ticks: every joint comes to rest and stays there, regardless of commands;
  // write() is not called until on_stop_reset().
  virtual void on_stop() = 0;
  virtual void on_stop_reset() = 0;

  // In the loop: fill `states` (in the order of state_interfaces()) and act on `commands` (order of
  // command_interfaces()). NaN in `commands`: no command yet. No allocation, no lock, no throw. read() is
  // called while inactive or active, write() while active.
  virtual HardwareReturn read(Time now, Duration period, std::span<double> states) = 0;
  virtual HardwareReturn write(Time now, Duration period, std::span<const double> commands) = 0;
  // The loop is blocked (control_loop.h): called once, from another thread, while read() or write() may
  // be running. Brings the joints to rest as far as the device can do so itself; on_stop() follows when
  // the loop continues.
  virtual void on_stall() noexcept {}

  // Between ticks: writes what changes while the component runs into the slot, whose memory it reuses.
  // False: it cannot be saved, as a device, whose joints cannot be brought back; then the twin is not
  // saved.
  [[nodiscard]] virtual bool save(SavedSlot& /*slot*/) const { return false; }
  // Between ticks: becomes as it was then. Its life cycle is in the same state, and the same commands are
  // claimed.
  virtual void restore(const SavedPart& /*saved*/) {}

  // Between ticks, while inactive: the drives of all joints are off, so that a hand can move them. Refused:
  // the device cannot do so.
  virtual Status relax() { return Status::refused("it cannot release its joints"); }
  // Between ticks, while active: see JointRelease. Then the joint holds where it was caught. Refused: the
  // device cannot do so, or it is not safe now.
  virtual Status release_joint(const JointRelease& /*release*/) {
    return Status::refused("it cannot release a single joint");
  }
  // Between ticks: a person has seen that the joints are at these positions (rad or m), which the device
  // cannot measure.
  virtual Status confirm_pose(std::span<const std::pair<std::string, double>> /*positions*/) {
    return Status::refused("it measures its positions; nothing is to be confirmed");
  }

  // Between ticks, some times a second: logs what has happened in the loop, where nothing may be logged.
  virtual void attend() {}
  // Between ticks. False: it is no device with something to report.
  [[nodiscard]] virtual bool report(DeviceReport& /*out*/) { return false; }

  // The reason why the last read() or write() did not return ok, as the end of a sentence. Between ticks.
  [[nodiscard]] virtual std::string fault() const { return "no reason given"; }

  // Between ticks, after an activation was refused: what it waits for, such as "the first states on '/x'".
  // Once it is empty, the same activation can succeed. Empty also where it waits for nothing.
  [[nodiscard]] virtual std::string awaits() const { return {}; }
};

}  // namespace doppel
