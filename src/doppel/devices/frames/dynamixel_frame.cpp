#include "doppel/devices/frames/dynamixel_frame.h"

#include <algorithm>

#include "doppel/devices/frames/checksums.h"

namespace doppel {
namespace {

constexpr std::array<std::uint8_t, 4> kHeader{0xFF, 0xFF, 0xFD, 0x00};
constexpr std::size_t kIdByte = 4, kLengthBytes = 5, kInstructionByte = 7, kFirstParameter = 8;
constexpr std::size_t kCrcSize = 2, kAround = kFirstParameter + kCrcSize;
constexpr std::size_t kMinLength = 3;  // instruction and CRC
// Bytes of a frame, when every third of its parameters is stuffed.
constexpr std::size_t kMaxSize = kAround + kDynamixelMaxParameters + kDynamixelMaxParameters / 3 + 1;
static_assert(kMaxSize <= FrameBytes::kCapacity);
constexpr std::string_view kParameters = "the parameters of a Dynamixel frame";

std::size_t word(std::span<const std::uint8_t> bytes, std::size_t index) {
  return static_cast<std::size_t>(bytes[index] | (bytes[index + 1] << 8));
}

// The bytes `index` - 2 to `index` are the header's first three.
bool ends_pattern(std::span<const std::uint8_t> bytes, std::size_t index) {
  return index >= 2 && bytes[index - 2] == 0xFF && bytes[index - 1] == 0xFF && bytes[index] == 0xFD;
}

void begin_frame(std::uint8_t id, FrameBytes& out) {
  out.add(kHeader);
  out.add(id);
  out.add_word(0);  // the length, when it is known
}

void end_frame(std::size_t begin, FrameBytes& out) {
  const std::size_t length = out.size() - begin - kInstructionByte + kCrcSize;
  out.set(begin + kLengthBytes, static_cast<std::uint8_t>(length & 0xFF));
  out.set(begin + kLengthBytes + 1, static_cast<std::uint8_t>(length >> 8));
  out.add_word(dynamixel_crc(out.bytes().subspan(begin)));
}

bool is_fast(std::uint8_t id, std::uint8_t instruction) {
  return id == kDynamixelBroadcast && instruction == static_cast<std::uint8_t>(DynamixelInstruction::status);
}

}  // namespace

void add_dynamixel_frame(const DynamixelFrame& frame, FrameBytes& out) {
  check_frame_size(kParameters, frame.parameters.size(), kDynamixelMaxParameters);
  const std::size_t begin = out.size();
  begin_frame(frame.id, out);
  const std::size_t stuffed = out.size();
  const auto add = [&](std::uint8_t byte) {
    out.add(byte);
    if (ends_pattern(out.bytes().subspan(stuffed), out.size() - stuffed - 1)) out.add(0xFD);
  };
  add(frame.instruction);
  for (const std::uint8_t byte : frame.parameters) add(byte);
  end_frame(begin, out);
}

void add_fast_answer(std::span<const std::uint8_t> parameters, FrameBytes& out) {
  check_frame_size(kParameters, parameters.size(), kMaxSize - kAround);
  const std::size_t begin = out.size();
  begin_frame(kDynamixelBroadcast, out);
  out.add(static_cast<std::uint8_t>(DynamixelInstruction::status));
  out.add(parameters);
  end_frame(begin, out);
}

std::size_t DynamixelReader::push(std::span<const std::uint8_t> bytes) {
  frame_ = {};
  return received_.push(bytes);
}
void DynamixelReader::clear() {
  frame_ = {};
  received_.clear();
}

void DynamixelReader::skip(std::size_t count) {
  counts_.noise += count;
  received_.advance(count);
}

// Copies instruction and parameters without their stuffing and returns how many bytes they are; nullopt:
// the pattern of a header is within them, so that this is no frame.
std::optional<std::size_t> DynamixelReader::unstuff(std::span<const std::uint8_t> stuffed_bytes) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < stuffed_bytes.size(); ++i) {
    parameters_[size++] = stuffed_bytes[i];
    if (!ends_pattern(stuffed_bytes, i)) continue;
    if (i + 1 >= stuffed_bytes.size() || stuffed_bytes[i + 1] != 0xFD) return std::nullopt;
    ++i;
  }
  return size;
}

std::optional<DynamixelFrame> DynamixelReader::next() {
  frame_ = {};
  for (;;) {
    const std::span<const std::uint8_t> rest = received_.rest();
    const std::size_t common = std::min(rest.size(), kHeader.size());
    if (!std::equal(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(common), kHeader.begin())) {
      // To the next byte that can begin a header.
      const auto header = std::find(rest.begin() + 1, rest.end(), kHeader[0]);
      skip(static_cast<std::size_t>(header - rest.begin()));
      continue;
    }
    if (rest.size() < kInstructionByte) return std::nullopt;
    const std::size_t length = word(rest, kLengthBytes), size = length + kInstructionByte;
    if (length < kMinLength || size > kMaxSize) {
      skip(1);
      continue;
    }
    if (rest.size() < size) return std::nullopt;
    const std::size_t crc = size - kCrcSize;
    if (dynamixel_crc(rest.first(crc)) != word(rest, crc)) {
      ++counts_.bad_checks;
      skip(1);
      continue;
    }
    const std::uint8_t id = rest[kIdByte], instruction = rest[kInstructionByte];
    const std::span<const std::uint8_t> body = rest.subspan(kInstructionByte, crc - kInstructionByte);
    DynamixelFrame out{id, instruction, body.subspan(1)};
    if (!is_fast(id, instruction)) {
      const std::optional<std::size_t> plain = unstuff(body);
      if (!plain || *plain > kDynamixelMaxParameters + 1) {
        skip(1);
        continue;
      }
      out.parameters = std::span(parameters_).subspan(1, *plain - 1);
    }
    frame_ = rest.first(size);
    received_.advance(size);
    ++counts_.frames;
    return out;
  }
}

std::optional<FastPart> DynamixelReader::fast_part(std::size_t index, std::size_t size) const {
  const std::size_t part = size + 2 + kCrcSize, begin = kFirstParameter + index * part;
  if (frame_.size() < begin + part) return std::nullopt;
  const std::size_t crc = begin + part - kCrcSize;
  if (dynamixel_crc(frame_.first(crc)) != word(frame_, crc)) return std::nullopt;
  return FastPart{frame_[begin], frame_[begin + 1], frame_.subspan(begin + 2, size)};
}

}  // namespace doppel
