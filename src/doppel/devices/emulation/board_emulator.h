#pragma once
// A board with hobby servos behind the contract of emulated devices: the firmware of
// examples/firmware/doppel_servo, compiled as it is, with pins and a wire of the emulation. A servo follows
// its pulse at its own speed, and reports nothing.

#include <memory>
#include <optional>
#include <vector>

#include "doppel/devices/emulation/arriving_bytes.h"
#include "doppel/devices/emulation/device_emulator.h"
#include "doppel/devices/emulation/emulated_faults.h"
#include "doppel/export.h"

namespace doppel {

struct HobbyServo {
  int channel = 0;
  double pulse_min = 500, pulse_max = 2500;  // us, at the ends of its travel
  double travel = 3.14159265358979;          // rad
  double velocity = 5;                       // rad/s, without a load
  double effort = 1;                         // N m
};

class DOPPEL_API BoardEmulator : public DeviceEmulator {
 public:
  BoardEmulator(std::vector<HobbyServo> servos, std::vector<EmulatedFault> faults = {},
                std::uint64_t seed = 1);
  ~BoardEmulator() override;

  void receive(std::span<const std::uint8_t> bytes, Time when, int rate) override;
  std::size_t take(std::span<std::uint8_t> out, Time until) override { return sent_.take(out, until); }
  [[nodiscard]] std::optional<Time> next_arrival() const override { return sent_.next_arrival(); }
  void step(Time now, Duration period, std::span<const MotorState> states,
            std::span<MotorDrive> drives) override;
  [[nodiscard]] bool is_plugged() const override { return plugged_; }
  void set_faults(std::vector<EmulatedFault> faults) override { faults_.replace(std::move(faults)); }
  void add_fault(const EmulatedFault& fault) { faults_.add(fault); }
  // us; 0: no pulse.
  [[nodiscard]] double pulse(int channel) const;
  void press_stop(bool pressed);

 private:
  class Pins;  // the firmware with its pins and its wire
  void send(std::span<const char> bytes);
  void start_line(Time when);

  std::vector<HobbyServo> servos_;
  std::vector<std::optional<double>> blocked_;  // rad, by the servos: since a fault blocks them
  FaultPlan faults_;
  ArrivingBytes sent_;
  Time now_{};
  Duration set_back_{};             // how far the firmware's clock is ahead of now_
  Time line_free_{}, host_free_{};  // when the last byte to and from the host ends
  int rate_ = 115200;
  bool plugged_ = true;
  std::unique_ptr<Pins> pins_;
};

}  // namespace doppel
