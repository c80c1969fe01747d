#pragma once
// A link that loses requests on their way to emulated servos.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "doppel/devices/emulation/emulated_link.h"
#include "doppel/devices/servos/servo_model.h"

namespace doppel::test {

// A request of the host, in either protocol.
struct SentRequest {
  static constexpr std::uint8_t kReadCode = 2, kWriteCode = 3, kSyncReadCode = 0x82, kFastSyncReadCode = 0x8A;

  int id = 0;
  std::uint8_t instruction = 0;
  std::size_t address = 0, size = 0;  // the registers that are read or written, of one servo
  std::uint8_t value = 0;             // the first byte that is written

  [[nodiscard]] bool has(const ServoRegister& which) const {
    return address <= which.address && which.address + std::size_t{which.size} <= address + size;
  }
  [[nodiscard]] bool reads(const ServoRegister& which) const {
    return instruction == kReadCode && has(which);
  }
  [[nodiscard]] bool writes(const ServoRegister& which) const {
    return instruction == kWriteCode && has(which);
  }
  [[nodiscard]] bool reads_all_servos() const {
    return instruction == kSyncReadCode || instruction == kFastSyncReadCode;
  }
};

inline SentRequest sent_request(std::span<const std::uint8_t> frame) {
  const bool dynamixel = frame[2] == 0xFD;
  const std::size_t begin = dynamixel ? 8 : 5;
  const std::size_t width = dynamixel ? 2 : 1;  // bytes of an address, of a size and of the check
  const std::span<const std::uint8_t> parameters = frame.subspan(begin, frame.size() - begin - width);
  const auto number = [&](std::size_t index) {
    std::size_t out = parameters[index * width];
    if (dynamixel) out += std::size_t{parameters[index * width + 1]} << 8;
    return out;
  };
  SentRequest out;
  out.id = frame[dynamixel ? 4 : 2];
  out.instruction = frame[dynamixel ? 7 : 4];
  if (out.instruction == SentRequest::kReadCode) {
    out.address = number(0);
    out.size = number(1);
  }
  if (out.instruction == SentRequest::kWriteCode) {
    out.address = number(0);
    out.size = parameters.size() - width;
    out.value = parameters[width];
  }
  return out;
}

class LossyLink final : public EmulatedLink {
 public:
  // True: this request does not reach the servos. May be empty, and may change; it outlives the link.
  using Loses = std::function<bool(const SentRequest&)>;
  LossyLink(const Loses& loses, DeviceEmulator& devices, std::string name, int rate)
      : EmulatedLink(devices, std::move(name), rate), loses_(loses) {}
  bool write(std::span<const std::uint8_t> bytes) override {
    return (loses_ && loses_(sent_request(bytes))) || EmulatedLink::write(bytes);
  }

 private:
  const Loses& loses_;
};

}  // namespace doppel::test
