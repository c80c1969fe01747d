#include "doppel/devices/frames/servo_line.h"

#include <algorithm>
#include <charconv>

#include "doppel/devices/frames/checksums.h"

namespace doppel {
namespace {

constexpr std::size_t kCheckSize = 6;  // " *CCCC"

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// The words of a body, which are separated by one space each.
class Words {
 public:
  explicit Words(std::string_view body) : rest_(body) {}
  // Empty: there is none, or it is empty.
  std::string_view word() {
    const std::size_t end = std::min(rest_.find(' '), rest_.size());
    const std::string_view out = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return out;
  }
  template <typename Number>
  bool number(Number& out, int base = 10) {
    const std::string_view text = word();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out, base);
    return error == std::errc() && end == text.data() + text.size() && !text.empty();
  }
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

std::optional<ServoLineIdentity> identity_of(Words words) {
  ServoLineIdentity out;
  if (words.word() != "doppel-servo" || !words.number(out.version) || !words.number(out.channels)) return {};
  if (!words.number(out.boot, 16) || !words.number(out.nonce, 16)) return {};
  out.firmware = words.word();
  if (out.firmware.empty() || !words.number(out.step) || !words.empty()) return {};
  if (out.channels == 0 || out.channels > kServoLineChannels) return {};
  return out;
}

std::optional<ServoLineState> state_of(Words words) {
  ServoLineState out;
  if (!words.number(out.sequence) || !words.number(out.milliseconds) || !words.number(out.flags)) return {};
  if (!words.number(out.millivolts)) return {};
  while (!words.empty() && !words.rest().starts_with("a ")) {
    if (out.channels == kServoLineChannels || !words.number(out.pulses[out.channels])) return {};
    ++out.channels;
  }
  if (!words.empty()) words.word();
  while (!words.empty()) {
    if (out.inputs == kServoLineChannels || !words.number(out.analog[out.inputs])) return {};
    ++out.inputs;
  }
  if (out.channels == 0) return {};
  return out;
}

std::optional<ServoLineAnswer> answer_of(Words words) {
  const std::string_view command = words.word();
  if (command.size() != 1) return {};
  ServoLineAnswer out{command.front(), {}};
  if (words.empty()) return out;
  std::uint32_t value = 0;
  if (!words.number(value) || !words.empty()) return {};
  out.value = value;
  return out;
}

std::optional<ServoLineFault> fault_of(Words words) {
  ServoLineFault out;
  if (!words.number(out.code)) return {};
  out.text = words.rest();
  return out;
}

template <typename Reply>
ServoLineReply reply(const std::optional<Reply>& parsed) {
  return parsed ? ServoLineReply(*parsed) : ServoLineReply();
}

std::array<char, kCheckSize> check_of(std::string_view body) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  const std::uint16_t crc = ccitt_crc(bytes_of(body));
  std::array<char, kCheckSize> out{' ', '*'};
  for (std::size_t i = 0; i < 4; ++i) out[2 + i] = kDigits[(crc >> (12 - 4 * i)) & 0xF];
  return out;
}

// The body of a line whose check is right; nullopt: it has none, or a wrong one.
std::optional<std::string_view> checked(std::string_view line) {
  if (line.size() <= kCheckSize) return {};
  const std::string_view body = line.substr(0, line.size() - kCheckSize);
  if (!std::ranges::equal(check_of(body), line.substr(body.size()))) return {};
  return body;
}

}  // namespace

void add_servo_line(std::string_view body, FrameBytes& out) {
  const auto check = check_of(body);
  out.add(bytes_of(body));
  out.add(bytes_of({check.data(), check.size()}));
  out.add('\n');
}

void add_servo_targets(std::uint32_t sequence, std::span<const std::uint16_t> targets, FrameBytes& out) {
  std::array<char, kServoLineMax> body{'P', ' '};
  char* end = body.data() + 2;
  char* const limit = body.data() + body.size();
  end = std::to_chars(end, limit, sequence).ptr;
  for (const std::uint16_t target : targets) {
    *end++ = ' ';
    if (target == 0) {
      *end++ = '-';
    } else {
      end = std::to_chars(end, limit, target).ptr;
    }
  }
  add_servo_line({body.data(), static_cast<std::size_t>(end - body.data())}, out);
}

void ServoLineReader::clear() {
  received_.clear();
  skipping_ = false;
}

std::optional<std::string_view> ServoLineReader::next() {
  for (;;) {
    const std::span<const std::uint8_t> rest = received_.rest();
    const auto newline = std::ranges::find(rest, std::uint8_t{'\n'});
    const auto size = static_cast<std::size_t>(newline - rest.begin());
    if (newline == rest.end()) {
      // A line without an end is noise: a port at the wrong rate, for instance.
      if (size < kServoLineMax) return std::nullopt;
      counts_.noise += size;
      received_.advance(size);
      skipping_ = true;
      return std::nullopt;
    }
    received_.advance(size + 1);
    std::string_view line(reinterpret_cast<const char*>(rest.data()), size);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (skipping_ || size >= kServoLineMax || line.empty()) {
      counts_.noise += size;
      skipping_ = false;
      continue;
    }
    const std::optional<std::string_view> body = checked(line);
    if (body) {
      ++counts_.frames;
      return body;
    }
    ++counts_.bad_checks;
  }
}

ServoLineReply parse_servo_reply(std::string_view body) {
  Words words(body);
  const std::string_view kind = words.word();
  if (kind == "I") return reply(identity_of(words));
  if (kind == "T") return reply(state_of(words));
  if (kind == "A") return reply(answer_of(words));
  if (kind == "!") return reply(fault_of(words));
  return {};
}

}  // namespace doppel
