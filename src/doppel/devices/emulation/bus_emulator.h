#pragma once
// Servos with registers on one half-duplex bus, behind the contract of emulated devices: Feetech's or
// Dynamixel's protocol.
//
// Timing: bytes take ten bits at the bus's rate; a servo answers after its return delay; answers to one
// request follow each other. A servo at another rate than the host's understands nothing and is silent.
// Bytes of the host while an answer is on its way damage both. Faults: emulated_faults.h; those with a
// share are drawn from `seed`, in the order of answers.

#include <vector>

#include "doppel/devices/emulation/arriving_bytes.h"
#include "doppel/devices/emulation/device_emulator.h"
#include "doppel/devices/emulation/emulated_faults.h"
#include "doppel/devices/emulation/register_servo.h"
#include "doppel/devices/frames/dynamixel_frame.h"
#include "doppel/devices/frames/feetech_frame.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API BusEmulator : public DeviceEmulator {
 public:
  // Precondition: all servos have this protocol, which is not that of the servo line.
  BusEmulator(ServoProtocol protocol, std::vector<RegisterServo> servos,
              std::vector<EmulatedFault> faults = {}, std::uint64_t seed = 1);

  void receive(std::span<const std::uint8_t> bytes, Time when, int rate) override;
  std::size_t take(std::span<std::uint8_t> out, Time until) override { return sent_.take(out, until); }
  [[nodiscard]] std::optional<Time> next_arrival() const override { return sent_.next_arrival(); }
  void step(Time now, Duration period, std::span<const MotorState> states,
            std::span<MotorDrive> drives) override;
  [[nodiscard]] bool is_plugged() const override { return plugged_; }

  [[nodiscard]] std::vector<RegisterServo>& servos() { return servos_; }
  void set_faults(std::vector<EmulatedFault> faults) override { faults_.replace(std::move(faults)); }
  void add_fault(const EmulatedFault& fault) { faults_.add(fault); }

 private:
  struct Request {
    int id = 0;
    std::uint8_t instruction = 0;
    std::span<const std::uint8_t> parameters;
  };
  void serve(const Request& request);
  void serve_id(const Request& request);
  void serve_one(RegisterServo& servo, const Request& request);
  void serve_sync_read(const Request& request, bool fast);
  void serve_sync_write(const Request& request);
  void serve_bulk_read(const Request& request);
  void serve_bulk_write(const Request& request);
  // id: the servo's before the request, which may have written another one.
  void answer(RegisterServo& servo, int id, AccessError error, std::span<const std::uint8_t> data);
  void answer_fast(std::span<const std::uint8_t> ids, std::size_t address, std::size_t size);
  // Puts bytes on the line, after `delay` of a free line.
  void put_on_line(std::span<const std::uint8_t> bytes, int servo, Duration delay);
  [[nodiscard]] bool hears(const RegisterServo& servo) const;
  void start_line(Time when);
  void clear_readers();
  void restart_all(Time now);

  const ServoProtocol protocol_;
  std::vector<RegisterServo> servos_;
  FaultPlan faults_;
  FeetechReader feetech_;
  DynamixelReader dynamixel_;
  ArrivingBytes sent_;
  Time now_{};        // of the last call
  Time line_free_{};  // when the last byte of host or servo ends
  int rate_ = 0;      // of the host's last bytes
  bool plugged_ = true, browned_out_ = false;
  Time silent_until_{};
};

}  // namespace doppel
