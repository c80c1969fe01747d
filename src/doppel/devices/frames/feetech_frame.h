#pragma once
// Frames of Feetech's serial bus servos (STS, SMS, SCS) and of Dynamixel's protocol 1.0, which they share:
//
//   FF FF ID LENGTH CODE parameters... SUM        LENGTH = parameters + 2, SUM: feetech_sum(ID to parameters)
//
// CODE is an instruction of the host, or the error bits of a servo's status. Source: "SMS STS protocol
// manual", Feetech, and its SDK.

#include <cstdint>
#include <optional>
#include <span>

#include "doppel/devices/frames/frame_bytes.h"
#include "doppel/export.h"

namespace doppel {

enum class FeetechInstruction : std::uint8_t {
  ping = 0x01,
  read = 0x02,
  write = 0x03,
  reg_write = 0x04,
  action = 0x05,
  recovery = 0x06,
  reset = 0x0A,
  sync_read = 0x82,
  sync_write = 0x83,
};

inline constexpr std::uint8_t kFeetechBroadcast = 0xFE;
inline constexpr std::size_t kFeetechMaxParameters = 253;

struct FeetechFrame {
  std::uint8_t id = 0;
  std::uint8_t code = 0;
  std::span<const std::uint8_t> parameters;
};

// Throws std::length_error beyond kFeetechMaxParameters, and where `out` has no room.
DOPPEL_API void add_feetech_frame(const FeetechFrame& frame, FrameBytes& out);

class DOPPEL_API FeetechReader {
 public:
  // Takes as many bytes as there is room for, and returns how many. next() makes room.
  std::size_t push(std::span<const std::uint8_t> bytes) { return received_.push(bytes); }
  // The next frame whose sum is right, valid until the next call; nullopt: more bytes are needed.
  [[nodiscard]] std::optional<FeetechFrame> next();
  // Forgets what was received.
  void clear() { received_.clear(); }
  [[nodiscard]] const StreamCounts& counts() const { return counts_; }

 private:
  void skip(std::size_t count);

  ReceivedBytes received_;
  StreamCounts counts_;
};

}  // namespace doppel
