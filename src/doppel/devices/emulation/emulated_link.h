#pragma once
// The host's end of an emulated bus, in the same process and in the time of a simulation: a wait passes at
// once, and the link's clock is then ahead of the simulation by the time that the exchange would have
// taken.

#include <functional>
#include <string>
#include <utility>

#include "doppel/devices/emulation/device_emulator.h"
#include "doppel/devices/serial/byte_link.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API EmulatedLink : public ByteLink {
 public:
  // `devices` outlives the link.
  EmulatedLink(DeviceEmulator& devices, std::string name, int rate)
      : devices_(devices), name_(std::move(name)), rate_(rate) {}

  // The simulation has reached `now`.
  void follow(Time now) {
    if (now > now_) now_ = now;
  }
  // Without a loop that steps the motors: `advance` is called before the clock moves on, and steps them
  // until then.
  void set_world(std::function<void(Time)> advance) { advance_ = std::move(advance); }

  [[nodiscard]] Time now() const override { return now_; }
  bool write(std::span<const std::uint8_t> bytes) override;
  std::size_t read(std::span<std::uint8_t> out, Time deadline) override;
  void discard() override;
  void wait_until(Time when) override { pass(when); }
  [[nodiscard]] bool is_lost() const override { return lost_ || !devices_.is_plugged(); }
  [[nodiscard]] const std::string& name() const override { return name_; }
  bool reopen(std::string& why) override;
  bool set_rate(int bits_per_second) override {
    rate_ = bits_per_second;
    return true;
  }

 private:
  void pass(Time when) {
    if (advance_ && when > now_) advance_(when);
    follow(when);
  }

  DeviceEmulator& devices_;
  const std::string name_;
  int rate_;
  bool lost_ = false;
  Time now_{};
  std::function<void(Time)> advance_;
};

}  // namespace doppel
