#pragma once
// Devices on a bus that are not there: they see the bytes of the host, move motors whose physics is the
// caller's, and answer after the time that a real bus needs. All times are those of the caller's clock,
// simulated or not, and do not decrease. Not for several threads.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/devices/emulation/emulated_faults.h"
#include "doppel/devices/frames/frame_bytes.h"
#include "doppel/export.h"

namespace doppel {

// A motor as its servo measures it, at the shaft.
struct MotorState {
  double position = 0;  // rad
  double velocity = 0;  // rad/s
  double effort = 0;    // N m, of the motor
};

// The drive of a motor by its servo until the next step.
struct MotorDrive {
  bool on = false;      // false: it turns freely
  double goal = 0;      // rad
  double velocity = 0;  // rad/s: at most, towards the goal
  double effort = 0;    // N m: at most
  double gain = 1;      // of the stiffness that it is delivered with
};

// How long the bytes that wait for a line may take: 100 ms, or a long frame.
[[nodiscard]] inline Duration line_buffer(int rate) {
  constexpr Duration kBuffer{100'000'000};
  constexpr double kFrame = 512 * kBitsPerByte;
  return std::max(kBuffer, from_seconds(kFrame / std::max(rate, 1)));
}

class DOPPEL_API DeviceEmulator {
 public:
  virtual ~DeviceEmulator() = default;

  // Bytes that the host begins to send at `when`, at `rate` bit/s. A pipe is faster than a line: what does
  // not fit into line_buffer() is lost, as in a UART. A new rate begins with a free line.
  virtual void receive(std::span<const std::uint8_t> bytes, Time when, int rate) = 0;
  // The bytes of the devices that have arrived by `until`; how many. They do not arrive twice.
  virtual std::size_t take(std::span<std::uint8_t> out, Time until) = 0;
  // When the next byte arrives; nullopt: the devices have nothing to say.
  [[nodiscard]] virtual std::optional<Time> next_arrival() const = 0;
  // The motors have reached `states` at `now`, `period` after the step before.
  virtual void step(Time now, Duration period, std::span<const MotorState> states,
                    std::span<MotorDrive> drives) = 0;
  // In place of those before; times are those of the caller's clock.
  virtual void set_faults(std::vector<EmulatedFault> faults) = 0;
  // False: the cable is unplugged.
  [[nodiscard]] virtual bool is_plugged() const = 0;
};

}  // namespace doppel
