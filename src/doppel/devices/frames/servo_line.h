#pragma once
// The line protocol of boards with hobby servos (docs/servo_line.md; examples/firmware/doppel_servo is the
// device): ASCII, at most 128 bytes, "BODY *CCCC\n" with CCCC = ccitt_crc(BODY) in hexadecimal digits. A
// line that is damaged is dropped and counted, and nothing is ever read as 0.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "doppel/devices/frames/frame_bytes.h"
#include "doppel/export.h"

namespace doppel {

inline constexpr std::size_t kServoLineMax = 128;      // bytes with the newline
inline constexpr std::size_t kServoLineChannels = 16;  // of one board

// Adds the check and the end of the line. Precondition: body and check are at most kServoLineMax bytes.
DOPPEL_API void add_servo_line(std::string_view body, FrameBytes& out);

class DOPPEL_API ServoLineReader {
 public:
  // Takes as many bytes as there is room for, and returns how many. next() makes room.
  std::size_t push(std::span<const std::uint8_t> bytes) { return received_.push(bytes); }
  // The body of the next whole line, valid until the next call; nullopt: more bytes are needed.
  [[nodiscard]] std::optional<std::string_view> next();
  // Forgets what was received.
  void clear();
  [[nodiscard]] const StreamCounts& counts() const { return counts_; }

 private:
  ReceivedBytes received_;
  bool skipping_ = false;  // the rest of a line that is too long
  StreamCounts counts_;
};

// -- lines of the host

// "P SEQ US US ...": targets in microseconds; 0: the channel keeps its target.
DOPPEL_API void add_servo_targets(std::uint32_t sequence, std::span<const std::uint16_t> targets,
                                  FrameBytes& out);

// -- lines of the device

struct ServoLineIdentity {  // "I doppel-servo 1 CHANNELS BOOT NONCE FIRMWARE STEP"
  unsigned version = 0, channels = 0;
  std::uint32_t boot = 0;   // random, of this boot
  std::uint32_t nonce = 0;  // of the hello that it answers
  std::string_view firmware;
  std::uint32_t step = 0;  // ns: the resolution of a pulse
};

struct ServoLineState {  // "T SEQ MS FLAGS MV US US ... [a ADC ...]"
  enum Flag : unsigned {
    kEnabled = 1,
    kRamping = 2,
    kWatchdog = 4,
    kClamped = 8,
    kBrownOut = 16,
    kStopPin = 32,
  };
  std::uint32_t sequence = 0, milliseconds = 0;
  unsigned flags = 0, millivolts = 0;
  std::size_t channels = 0, inputs = 0;
  std::array<std::uint16_t, kServoLineChannels> pulses{};  // us, of now; 0: no pulse
  std::array<std::uint16_t, kServoLineChannels> analog{};
};

struct ServoLineAnswer {  // "A C 3", "A W", "A E 63"
  char command = 0;
  std::optional<std::uint32_t> value;
};

struct ServoLineFault {  // "! CODE TEXT"
  unsigned code = 0;
  std::string_view text;
};

using ServoLineReply =
    std::variant<std::monostate, ServoLineIdentity, ServoLineState, ServoLineAnswer, ServoLineFault>;
// monostate: it is none of these.
[[nodiscard]] DOPPEL_API ServoLineReply parse_servo_reply(std::string_view body);

}  // namespace doppel
