#include "doppel/devices/emulation/board_emulator.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/devices/frames/frame_bytes.h"
#include "doppel_servo.h"

namespace doppel {
namespace {

constexpr int kSupply = 5000;  // mV
constexpr int kAll = -1;

}  // namespace

class BoardEmulator::Pins final : public doppel_servo::Board {
 public:
  Pins(BoardEmulator& owner, const doppel_servo::Config& config) : firmware(*this, config), owner_(owner) {}
  virtual ~Pins() = default;

  uint32_t milliseconds() override {
    return static_cast<uint32_t>((owner_.now_ + owner_.set_back_).time_since_epoch().count() / 1'000'000);
  }
  void pulse(uint8_t channel, uint32_t nanoseconds) override { pulses[channel] = 1e-3 * nanoseconds; }
  int32_t millivolts() override { return supply; }
  uint16_t analog(uint8_t /*input*/) override { return 0; }
  bool stop_pin() override { return stop; }
  uint32_t random_id() override { return static_cast<uint32_t>(owner_.faults_.random()); }
  void send(const char* bytes, size_t size) override { owner_.send({bytes, size}); }

  std::array<double, doppel_servo::kMaxChannels> pulses{};
  int32_t supply = kSupply;
  bool stop = false;
  doppel_servo::Firmware firmware;

 private:
  BoardEmulator& owner_;
};

BoardEmulator::BoardEmulator(std::vector<HobbyServo> servos, std::vector<EmulatedFault> faults,
                             std::uint64_t seed)
    : servos_(std::move(servos)), blocked_(servos_.size()), faults_(std::move(faults), seed) {
  doppel_servo::Config config;
  config.channels = 0;
  for (const HobbyServo& one : servos_)
    config.channels = static_cast<uint8_t>(std::max<int>(config.channels, one.channel + 1));
  config.step_ns = 305;  // 16 bits of 20 ms
  pins_ = std::make_unique<Pins>(*this, config);
}

BoardEmulator::~BoardEmulator() = default;

double BoardEmulator::pulse(int channel) const {
  return pins_->pulses[static_cast<std::size_t>(channel)];
}

void BoardEmulator::press_stop(bool pressed) {
  pins_->stop = pressed;
}

void BoardEmulator::send(std::span<const char> bytes) {
  if (faults_.draw(FaultKind::drop, kAll, now_)) return;
  const std::size_t bad =
      faults_.draw(FaultKind::corrupt, kAll, now_) ? faults_.random() % bytes.size() : bytes.size();
  Time when = std::max(now_, line_free_);
  if (when > now_ + line_buffer(rate_)) return;
  if (faults_.draw(FaultKind::late, kAll, now_))
    when += from_seconds(faults_.find(FaultKind::late, kAll, now_)->amount);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    when += from_seconds(kBitsPerByte / rate_);
    const auto byte = static_cast<std::uint8_t>(bytes[i]);
    sent_.add(when, i == bad ? static_cast<std::uint8_t>(byte ^ 1U) : byte);
  }
  line_free_ = when;
}

// Bytes that are on their way at the former rate cannot be read at the new one. The firmware has had the
// bytes that were given to it, and its clock does not go back.
void BoardEmulator::start_line(Time when) {
  if (now_ > when) set_back_ += now_ - when;
  now_ = std::min(now_, when);
  host_free_ = line_free_ = std::min(line_free_, when);
  sent_.bytes().clear();
}

void BoardEmulator::receive(std::span<const std::uint8_t> bytes, Time when, int rate) {
  if (rate != rate_) start_line(when);
  now_ = std::max(now_, when);
  if (!plugged_) return;
  rate_ = rate;
  Time end = std::max(when, host_free_);
  for (const std::uint8_t byte : bytes) {
    end += from_seconds(kBitsPerByte / rate);
    if (end > when + line_buffer(rate)) break;
    host_free_ = end;
    now_ = std::max(now_, end);
    pins_->firmware.receive(byte);
  }
}

void BoardEmulator::step(Time now, Duration /*period*/, std::span<const MotorState> states,
                         std::span<MotorDrive> drives) {
  now_ = std::max(now_, now);
  plugged_ = faults_.find(FaultKind::unplug, kAll, now_) == nullptr;
  if (!plugged_) sent_.bytes().clear();
  pins_->supply = faults_.find(FaultKind::brown_out, kAll, now_) != nullptr ? 0 : kSupply;
  pins_->firmware.tick();
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    const HobbyServo& servo = servos_[i];
    const double width = pulse(servo.channel), middle = (servo.pulse_min + servo.pulse_max) / 2;
    const double angle = (width - middle) / (servo.pulse_max - servo.pulse_min) * servo.travel;
    const EmulatedFault* const slip = faults_.find(FaultKind::slip, servo.channel, now_);
    const bool stuck = faults_.find(FaultKind::stuck, servo.channel, now_) != nullptr;
    if (!stuck) blocked_[i].reset();
    if (stuck && !blocked_[i]) blocked_[i] = states[i].position;
    const bool flipped = faults_.find(FaultKind::wrong_direction, servo.channel, now_) != nullptr;
    MotorDrive& drive = drives[i];
    drive.on = stuck || (width > 0 && pins_->supply > 0);
    drive.goal = stuck ? *blocked_[i] : (flipped ? -angle : angle) - (slip != nullptr ? slip->amount : 0);
    drive.velocity = servo.velocity;
    drive.effort = servo.effort;
    drive.gain = 1;
  }
}

}  // namespace doppel
