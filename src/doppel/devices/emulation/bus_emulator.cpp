#include "doppel/devices/emulation/bus_emulator.h"

#include <algorithm>
#include <array>

#include "doppel/devices/frames/checksums.h"

namespace doppel {
namespace {

constexpr int kBroadcast = 0xFE;
constexpr Duration kRestartTime{200'000'000};
constexpr Duration kPauseEndsFrame{100'000'000};  // longer than those that a busy host makes
// The two protocols share these instructions.
constexpr std::uint8_t kPing = 1, kRead = 2, kWrite = 3, kRegisteredWrite = 4, kAction = 5, kReboot = 8,
                       kSyncRead = 0x82, kSyncWrite = 0x83;
// Dynamixel's alone.
constexpr std::uint8_t kFastSyncRead = 0x8A, kBulkRead = 0x92, kBulkWrite = 0x93;
constexpr std::size_t kBulkHead = 5;  // id, address and size

Duration byte_time(int rate) {
  return from_seconds(kBitsPerByte / std::max(rate, 1));
}

std::size_t word(std::span<const std::uint8_t> bytes, std::size_t index) {
  return static_cast<std::size_t>(bytes[index] | (bytes[index + 1] << 8));
}

}  // namespace

BusEmulator::BusEmulator(ServoProtocol protocol, std::vector<RegisterServo> servos,
                         std::vector<EmulatedFault> faults, std::uint64_t seed)
    : protocol_(protocol), servos_(std::move(servos)), faults_(std::move(faults), seed) {}

// -- the line

void BusEmulator::put_on_line(std::span<const std::uint8_t> bytes, int servo, Duration delay) {
  if (faults_.draw(FaultKind::drop, servo, now_)) return;
  Time when = std::max(now_, line_free_) + delay;
  if (faults_.draw(FaultKind::late, servo, now_))
    when += from_seconds(faults_.find(FaultKind::late, servo, now_)->amount);
  const std::size_t bad =
      faults_.draw(FaultKind::corrupt, servo, now_) ? faults_.random() % bytes.size() : bytes.size();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    when += byte_time(rate_);
    const auto flipped = static_cast<std::uint8_t>(1U << (faults_.random() % 8));
    sent_.add(when, i == bad ? static_cast<std::uint8_t>(bytes[i] ^ flipped) : bytes[i]);
  }
  line_free_ = std::max(line_free_, when);
}

void BusEmulator::answer(RegisterServo& servo, int id, AccessError error,
                         std::span<const std::uint8_t> data) {
  if (id == kBroadcast) return;
  FrameBytes frame;
  const auto address = static_cast<std::uint8_t>(faults_.draw(FaultKind::stranger, id, now_) ? id + 1 : id);
  if (protocol_ == ServoProtocol::feetech) {
    add_feetech_frame({address, servo.error_byte(error), data}, frame);
  } else {
    FrameBytes parameters;
    parameters.add(servo.error_byte(error));
    parameters.add(data);
    add_dynamixel_frame(
        {address, static_cast<std::uint8_t>(DynamixelInstruction::status), parameters.bytes()}, frame);
  }
  put_on_line(frame.bytes(), id, servo.return_delay());
}

// Each servo adds its part to the one frame; a servo that is missing ends it for those after it.
void BusEmulator::answer_fast(std::span<const std::uint8_t> ids, std::size_t address, std::size_t size) {
  const std::size_t part = size + 4, length = 1 + ids.size() * part;
  if (length > kDynamixelMaxParameters) return;  // no servo has room for it
  FrameBytes frame;
  for (const std::uint8_t byte : {std::uint8_t{0xFF}, std::uint8_t{0xFF}, std::uint8_t{0xFD},
                                  std::uint8_t{0x00}, std::uint8_t{kBroadcast}})
    frame.add(byte);
  frame.add_word(static_cast<std::uint16_t>(length));
  frame.add(static_cast<std::uint8_t>(DynamixelInstruction::status));
  Duration delay{};
  for (const std::uint8_t id : ids) {
    const auto servo =
        std::ranges::find_if(servos_, [&](const RegisterServo& one) { return one.id() == id; });
    if (servo == servos_.end() || !hears(*servo) || faults_.draw(FaultKind::drop, id, now_)) break;
    const auto data = servo->bytes(address, size);
    if (data.empty()) break;
    frame.add(servo->error_byte(AccessError::none));
    frame.add(id);
    frame.add(data);
    frame.add_word(dynamixel_crc(frame.bytes()));
    delay = std::max(delay, servo->return_delay());
  }
  put_on_line(frame.bytes(), kBroadcast, delay);
}

bool BusEmulator::hears(const RegisterServo& servo) const {
  return servo.rate() == rate_ && now_ >= silent_until_;
}

// Bytes that are on their way at the former rate cannot be read at the new one.
void BusEmulator::start_line(Time when) {
  now_ = std::min(now_, when);
  line_free_ = std::min(line_free_, when);
  sent_.bytes().clear();
  clear_readers();
}

void BusEmulator::clear_readers() {
  feetech_.clear();
  dynamixel_.clear();
}

void BusEmulator::receive(std::span<const std::uint8_t> bytes, Time when, int rate) {
  if (rate != rate_) start_line(when);
  // Servos take the rest of a frame for a new one after a pause.
  if (when > line_free_ + kPauseEndsFrame) clear_readers();
  now_ = std::max(now_, when);
  rate_ = rate;
  const Duration room = when + line_buffer(rate) - std::max(now_, line_free_);
  const auto fitting = static_cast<std::size_t>(std::max(room, Duration{}) / byte_time(rate));
  bytes = bytes.first(std::min(bytes.size(), fitting));
  if (!plugged_ || bytes.empty()) return;
  const bool collides = !sent_.bytes().empty();
  if (faults_.find(FaultKind::echo, kBroadcast, now_) != nullptr) {
    Time arrival = std::max(now_, line_free_);
    for (const std::uint8_t byte : bytes) sent_.add(arrival += byte_time(rate), byte);
  }
  // If host and servo drive the line at once, both are damaged: neither frame has a right check.
  if (collides) {
    for (ArrivingByte& one : sent_.bytes()) one.byte = static_cast<std::uint8_t>(one.byte ^ 0xFF);
  }
  now_ = std::max(now_, line_free_) + byte_time(rate) * static_cast<std::int64_t>(bytes.size());
  line_free_ = now_;
  for (std::size_t read = 0; !collides && read < bytes.size();) {
    const auto rest = bytes.subspan(read);
    read += protocol_ == ServoProtocol::feetech ? feetech_.push(rest) : dynamixel_.push(rest);
    if (protocol_ == ServoProtocol::feetech) {
      while (const auto frame = feetech_.next()) serve({frame->id, frame->code, frame->parameters});
    } else {
      while (const auto frame = dynamixel_.next()) {
        if (frame->instruction != static_cast<std::uint8_t>(DynamixelInstruction::status))
          serve({frame->id, frame->instruction, frame->parameters});
      }
    }
  }
}

// -- requests

void BusEmulator::serve(const Request& request) {
  for (RegisterServo& servo : servos_) {
    if (hears(servo)) servo.notice_host(now_);
  }
  const bool dynamixel = protocol_ == ServoProtocol::dynamixel;
  switch (request.instruction) {
    case kSyncRead:
      return serve_sync_read(request, false);
    case kFastSyncRead:
      if (dynamixel) serve_sync_read(request, true);
      return;
    case kSyncWrite:
      return serve_sync_write(request);
    case kBulkRead:
      if (dynamixel) serve_bulk_read(request);
      return;
    case kBulkWrite:
      if (dynamixel) serve_bulk_write(request);
      return;
    default:
      break;
  }
  if (request.id != kBroadcast) return serve_id(request);
  for (RegisterServo& servo : servos_) {
    if (hears(servo)) serve_one(servo, request);
  }
}

// Servos that share an id answer at once: the line is low where one of them drives it low.
void BusEmulator::serve_id(const Request& request) {
  std::deque<ArrivingByte> before, all;
  std::deque<ArrivingByte>& sent = sent_.bytes();
  before.swap(sent);
  const Time free = line_free_;
  for (RegisterServo& servo : servos_) {
    if (servo.id() != request.id || !hears(servo)) continue;
    line_free_ = free;
    serve_one(servo, request);
    for (std::size_t i = 0; i < sent.size(); ++i) {
      if (i < all.size()) {
        all[i].byte = static_cast<std::uint8_t>(all[i].byte & sent[i].byte);
      } else {
        all.push_back(sent[i]);
      }
    }
    sent.clear();
  }
  sent.swap(before);
  sent.insert(sent.end(), all.begin(), all.end());
}

void BusEmulator::serve_one(RegisterServo& servo, const Request& request) {
  const bool feetech = protocol_ == ServoProtocol::feetech, broadcast = request.id == kBroadcast;
  const std::size_t width = feetech ? 1 : 2;  // bytes of an address or a size
  const int id = servo.id();
  const auto number = [&](std::size_t index) {
    return feetech ? request.parameters[index] : word(request.parameters, 2 * index);
  };
  switch (request.instruction) {
    case kPing: {
      const auto version = static_cast<std::uint8_t>(servo.value(ServoRole::firmware));
      const std::uint16_t model = servo.model().number;
      const std::array<std::uint8_t, 3> data{static_cast<std::uint8_t>(model & 0xFF),
                                             static_cast<std::uint8_t>(model >> 8), version};
      return answer(servo, id, AccessError::none, std::span(data).first(feetech ? 0 : data.size()));
    }
    case kRead: {
      if (broadcast || request.parameters.size() != 2 * width) return;
      const auto data = servo.bytes(number(0), number(1));
      return answer(servo, id, data.empty() ? AccessError::length : AccessError::none, data);
    }
    case kWrite: {
      if (request.parameters.size() <= width) return;
      const AccessError error = servo.write(number(0), request.parameters.subspan(width));
      if (!broadcast && servo.answers_writes()) answer(servo, id, error, {});
      return;
    }
    case kRegisteredWrite:
      if (request.parameters.size() <= width) return;
      servo.keep_write(number(0), request.parameters.subspan(width));
      if (!broadcast && servo.answers_writes()) answer(servo, id, AccessError::none, {});
      return;
    case kAction: {
      const AccessError error = servo.do_kept_write();
      if (!broadcast && servo.answers_writes()) answer(servo, id, error, {});
      return;
    }
    case kReboot:
      if (feetech) return;
      if (!broadcast) answer(servo, id, AccessError::none, {});
      return servo.restart();
    default:
      if (!broadcast) answer(servo, id, AccessError::instruction, {});
  }
}

void BusEmulator::serve_sync_read(const Request& request, bool fast) {
  const bool feetech = protocol_ == ServoProtocol::feetech;
  const std::size_t head = feetech ? 2 : 4;
  if (request.parameters.size() <= head) return;
  const std::size_t address = feetech ? request.parameters[0] : word(request.parameters, 0);
  const std::size_t size = feetech ? request.parameters[1] : word(request.parameters, 2);
  const auto ids = request.parameters.subspan(head);
  if (fast) return answer_fast(ids, address, size);
  for (const std::uint8_t id : ids) {
    for (RegisterServo& servo : servos_) {
      if (servo.id() != id || !hears(servo)) continue;
      if (const auto data = servo.bytes(address, size); !data.empty())
        answer(servo, servo.id(), AccessError::none, data);
    }
  }
}

void BusEmulator::serve_sync_write(const Request& request) {
  const bool feetech = protocol_ == ServoProtocol::feetech;
  const std::size_t head = feetech ? 2 : 4;
  if (request.parameters.size() <= head) return;
  const std::size_t address = feetech ? request.parameters[0] : word(request.parameters, 0);
  const std::size_t size = feetech ? request.parameters[1] : word(request.parameters, 2);
  for (auto blocks = request.parameters.subspan(head); blocks.size() > size;
       blocks = blocks.subspan(size + 1)) {
    for (RegisterServo& servo : servos_) {
      if (servo.id() == blocks[0] && hears(servo))
        static_cast<void>(servo.write(address, blocks.subspan(1, size)));
    }
  }
}

void BusEmulator::serve_bulk_read(const Request& request) {
  for (auto rest = request.parameters; rest.size() >= kBulkHead; rest = rest.subspan(kBulkHead)) {
    for (RegisterServo& servo : servos_) {
      if (servo.id() != rest[0] || !hears(servo)) continue;
      if (const auto data = servo.bytes(word(rest, 1), word(rest, 3)); !data.empty())
        answer(servo, servo.id(), AccessError::none, data);
    }
  }
}

void BusEmulator::serve_bulk_write(const Request& request) {
  for (auto rest = request.parameters; rest.size() >= kBulkHead;) {
    const std::size_t size = word(rest, 3);
    if (rest.size() < kBulkHead + size) return;
    for (RegisterServo& servo : servos_) {
      if (servo.id() == rest[0] && hears(servo))
        static_cast<void>(servo.write(word(rest, 1), rest.subspan(kBulkHead, size)));
    }
    rest = rest.subspan(kBulkHead + size);
  }
}

// -- the motors

void BusEmulator::restart_all(Time now) {
  for (RegisterServo& servo : servos_) servo.restart();
  silent_until_ = now + kRestartTime;
  sent_.bytes().clear();
}

void BusEmulator::step(Time now, Duration period, std::span<const MotorState> states,
                       std::span<MotorDrive> drives) {
  now_ = std::max(now_, now);
  plugged_ = faults_.find(FaultKind::unplug, kBroadcast, now) == nullptr;
  if (!plugged_) sent_.bytes().clear();
  const bool brown_out = faults_.find(FaultKind::brown_out, kBroadcast, now) != nullptr;
  if (brown_out && !browned_out_) restart_all(now);
  browned_out_ = brown_out;
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    const int id = servos_[i].id();
    RegisterServo::Disturbance disturbance;
    disturbance.stuck = faults_.find(FaultKind::stuck, id, now) != nullptr;
    disturbance.flipped = faults_.find(FaultKind::wrong_direction, id, now) != nullptr;
    disturbance.overload = faults_.find(FaultKind::overload, id, now) != nullptr;
    if (const EmulatedFault* const slip = faults_.find(FaultKind::slip, id, now))
      disturbance.slip = slip->amount;
    if (const EmulatedFault* const hot = faults_.find(FaultKind::hot, id, now))
      disturbance.temperature = hot->amount;
    servos_[i].step(now, period, states[i], disturbance, drives[i]);
  }
}

}  // namespace doppel
