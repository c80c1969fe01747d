#pragma once
// Frames of Dynamixel's protocol 2.0:
//
//   FF FF FD 00 ID LENGTH(2) INSTRUCTION parameters... CRC(2)     LENGTH = bytes from INSTRUCTION to CRC
//
// The CRC is dynamixel_crc over all before it. Where FF FF FD appears from INSTRUCTION to the last
// parameter, FD is doubled (byte stuffing), which LENGTH and CRC count. The answer to a fast sync read
// comes from several servos in one frame without stuffing: for each servo its error bits, its id, its data
// and a CRC over all bytes up to there. Source: emanual.robotis.com, "DYNAMIXEL Protocol 2.0".

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "doppel/devices/frames/frame_bytes.h"
#include "doppel/export.h"

namespace doppel {

enum class DynamixelInstruction : std::uint8_t {
  ping = 0x01,
  read = 0x02,
  write = 0x03,
  reg_write = 0x04,
  action = 0x05,
  factory_reset = 0x06,
  reboot = 0x08,
  clear = 0x10,
  backup = 0x20,
  status = 0x55,
  sync_read = 0x82,
  sync_write = 0x83,
  fast_sync_read = 0x8A,
  bulk_read = 0x92,
  bulk_write = 0x93,
};

inline constexpr std::uint8_t kDynamixelBroadcast = 0xFE;
// The bound of a frame that this program sends or takes; the protocol's own bound is 65532.
inline constexpr std::size_t kDynamixelMaxParameters = 900;

struct DynamixelFrame {
  std::uint8_t id = 0;
  std::uint8_t instruction = 0;
  // Without stuffing. Of a status frame the first one holds the error bits. Of a fast answer: all bytes
  // from the first servo's error bits to the last one's data.
  std::span<const std::uint8_t> parameters;
};

// Throws std::length_error beyond kDynamixelMaxParameters, and where `out` has no room.
DOPPEL_API void add_dynamixel_frame(const DynamixelFrame& frame, FrameBytes& out);
// Without stuffing, as the answer to a fast sync read; the CRCs within it are the caller's.
DOPPEL_API void add_fast_answer(std::span<const std::uint8_t> parameters, FrameBytes& out);

// One servo's part of a fast answer.
struct FastPart {
  std::uint8_t error = 0, id = 0;
  std::span<const std::uint8_t> data;
};

class DOPPEL_API DynamixelReader {
 public:
  // Takes as many bytes as there is room for, and returns how many. next() makes room.
  std::size_t push(std::span<const std::uint8_t> bytes);
  // The next frame whose CRC is right, valid until the next call; nullopt: more bytes are needed.
  [[nodiscard]] std::optional<DynamixelFrame> next();
  // A part of the frame that next() has returned last, an answer to a fast sync read of `size` bytes: the
  // part of its servo `index`. nullopt: there is no such part, or the CRC before its end is wrong.
  [[nodiscard]] std::optional<FastPart> fast_part(std::size_t index, std::size_t size) const;
  // Forgets what was received.
  void clear();
  [[nodiscard]] const StreamCounts& counts() const { return counts_; }

 private:
  void skip(std::size_t count);
  [[nodiscard]] std::optional<std::size_t> unstuff(std::span<const std::uint8_t> stuffed_bytes);

  ReceivedBytes received_;
  std::span<const std::uint8_t> frame_;  // the last one, with its header
  std::array<std::uint8_t, FrameBytes::kCapacity> parameters_{};
  StreamCounts counts_;
};

}  // namespace doppel
