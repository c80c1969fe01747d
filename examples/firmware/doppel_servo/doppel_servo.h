#pragma once
// Firmware of a board with hobby PWM servos, for any board: the line protocol of docs/servo_line.md, a ramp
// per channel, a watchdog, a stop pin, a check of the servos' supply. The sketch beside it gives it pins and
// a port; doppel's emulator and tests give it a clock and a wire. It is C++11 without heap, exceptions, RTTI,
// containers and floating point. Nothing here is a safety function in the sense of a standard.

#include <stddef.h>
#include <stdint.h>

#include "servo_ramp.h"
#include "servo_text.h"

namespace doppel_servo {

constexpr uint32_t kProtocol = 1;
constexpr uint8_t kMaxChannels = 16;
constexpr uint8_t kMaxInputs = 8;
constexpr uint32_t kMaxSpeed = 100000;           // us/s
constexpr uint32_t kMaxAcceleration = 10000000;  // us/s^2
constexpr uint32_t kMinWatchdog = 20;            // ms
constexpr uint32_t kMaxWatchdog = 10000;         // ms
constexpr uint32_t kDefaultWatchdog = 300;       // ms
constexpr uint32_t kMaxCatchUp = 20;             // ms of motion after a loop that took longer
constexpr uint32_t kDroppedReportPeriod = 1000;  // ms
constexpr uint8_t kSupplyReadings = 3;           // equal ones in a row, 1 ms apart, against single wrong ones

inline const char* firmware_version() {
  return "1.0.0";
}

enum Flag : uint8_t {
  kEnabled = 1,    // channels are enabled
  kRamping = 2,    // a pulse is on its way
  kWatchdog = 4,   // the host was silent; until the next E
  kClamped = 8,    // a target was outside the limits of its channel
  kBrownOut = 16,  // the servos' supply is low
  kStopPin = 32,   // the stop pin was active; until the next E
};

enum Code : uint8_t {
  // Refusals: the answer to a line that changes nothing.
  kVersionRefused = 1,
  kNoHello = 2,
  kMalformed = 3,
  kOutOfRange = 4,
  kNoLimits = 5,
  kChannelBusy = 6,
  kStopPinActive = 7,
  kNoSupply = 8,
  // Events: sent at once, in answer to nothing.
  kSilence = 20,
  kSupplyLow = 21,
  kSupplyLost = 22,
  kStopped = 23,
  kLinesDropped = 24,
};

// The hardware. No function may block for longer than some milliseconds.
class Board {
 public:
  virtual uint32_t milliseconds() = 0;  // wraps around
  // Repeats a pulse of that width every 20 ms; 0: no pulse. Slow ramps use the whole resolution of ns.
  virtual void pulse(uint8_t channel, uint32_t nanoseconds) = 0;
  virtual int32_t millivolts() = 0;  // of the servos' supply; negative: not measured
  virtual uint16_t analog(uint8_t input) = 0;
  virtual bool stop_pin() = 0;       // true: stop
  virtual uint32_t random_id() = 0;  // another one at each call and after each start
  virtual void send(const char* bytes, size_t size) = 0;

 protected:
  ~Board() = default;  // not virtual: a virtual one refers to operator delete
};

struct Config {
  uint8_t channels;         // 1..kMaxChannels
  uint8_t inputs;           // analog; as many are sent as fit into a line
  uint32_t step_ns;         // resolution of a pulse
  int32_t brown_out_mv;     // below it the supply is low
  int32_t hysteresis_mv;    // above brown_out_mv + hysteresis_mv it is good again
  int32_t lost_mv;          // below it the servos have no power
  uint8_t pulse_period_ms;  // between two writes of a pulse that moves

  Config()
      : channels(6),
        inputs(0),
        step_ns(1000),
        brown_out_mv(4300),
        hysteresis_mv(200),
        lost_mv(2500),
        pulse_period_ms(1) {}
};

class Firmware {
 public:
  explicit Firmware(Board& board, const Config& config = Config()) : board_(board), config_(config) {
    if (config_.channels > kMaxChannels) config_.channels = kMaxChannels;
    if (config_.channels == 0) config_.channels = 1;
    const size_t most = inputs_with(config_.channels);
    if (config_.inputs > most) config_.inputs = static_cast<uint8_t>(most);
    if (config_.pulse_period_ms == 0) config_.pulse_period_ms = 1;
  }

  // How many analog inputs fit into `T` with that many channels, with the longest numbers.
  static size_t inputs_with(uint8_t channels) {
    const size_t fixed = 2 + 11 + 11 + 3 + 5 + 7;  // "T ", sequence, ms, flags, mV, check
    const size_t free = kMaxLine - fixed - 5U * channels;
    const size_t fit = free > 2 ? (free - 2) / 6 : 0;  // " a", and " 65535" each
    return fit > kMaxInputs ? kMaxInputs : fit;
  }

  // Each byte that the port received. A whole line is answered before this returns.
  void receive(uint8_t byte) {
    start();
    if (byte == '\n') {
      if (too_long_) {
        ++dropped_;
      } else if (size_ > 0) {
        take_line();
      }
      size_ = 0;
      too_long_ = false;
    } else if (size_ == kMaxLine - 1) {
      too_long_ = true;
    } else if (!too_long_) {
      line_[size_++] = static_cast<char>(byte);
    }
  }

  // Called by each turn of the loop; once per millisecond is enough.
  void tick() {
    start();
    const uint32_t now = board_.milliseconds();
    const uint32_t elapsed = now - ticked_;
    if (elapsed == 0) return;
    ticked_ = now;
    watch_stop_pin();
    watch_supply();
    watch_silence(now);
    const uint32_t steps = elapsed < kMaxCatchUp ? elapsed : kMaxCatchUp;
    for (uint8_t i = 0; i < config_.channels; ++i) {
      for (uint32_t step = 0; channels_[i].live && step < steps; ++step) channels_[i].ramp.step();
    }
    if (now - written_ >= config_.pulse_period_ms) {
      written_ = now;
      for (uint8_t i = 0; i < config_.channels; ++i) write_pulse(i);
    }
    report_dropped(now);
  }

  uint32_t boot() const { return boot_; }
  uint32_t dropped_lines() const { return dropped_; }  // since the start
  uint32_t enabled_mask() const {
    uint32_t mask = 0;
    for (uint8_t i = 0; i < config_.channels; ++i) mask |= channels_[i].enabled ? 1U << i : 0;
    return mask;
  }
  uint32_t flags() const {
    uint32_t out = latched_ | (supply_low_ ? uint32_t(kBrownOut) : 0);
    for (uint8_t i = 0; i < config_.channels; ++i) {
      const Channel& channel = channels_[i];
      out |= channel.enabled ? uint32_t(kEnabled) : 0;
      out |= channel.clamped ? uint32_t(kClamped) : 0;
      out |= channel.live && !channel.ramp.at_rest() ? uint32_t(kRamping) : 0;
    }
    return out;
  }

 private:
  struct Channel {
    Ramp ramp;
    uint32_t written = 0;  // ns
    bool limited = false;  // it has had a `C`
    bool enabled = false;  // by `E`
    bool live = false;     // it has a pulse
    bool clamped = false;
  };

  void start() {
    if (started_) return;
    started_ = true;
    ticked_ = written_ = board_.milliseconds();
    for (uint8_t i = 0; i < config_.channels; ++i) board_.pulse(i, 0);
    new_boot();
    send_identity(0);
    const int32_t supply = board_.millivolts();
    supply_lost_ = supply >= 0 && supply < config_.lost_mv;
    supply_low_ = supply >= 0 && supply < config_.brown_out_mv;
    if (supply_low_) send_supply_event(supply);
  }

  void new_boot() {
    const uint32_t previous = boot_;
    boot_ = board_.random_id();
    while (boot_ == 0 || boot_ == previous) ++boot_;
  }

  // -- lines

  void take_line() {
    size_t size = size_;
    if (line_[size - 1] == '\r') --size;
    if (size == 0) return;
    const size_t body = size - 6;
    if (size <= 6 || !has_check(body)) {
      ++dropped_;
      return;
    }
    if (execute(line_[0], Words(line_, line_ + body))) heard_ = board_.milliseconds();
  }

  bool has_check(size_t body) const {
    const uint32_t crc = crc16(line_, body);
    bool right = line_[body] == ' ' && line_[body + 1] == '*';
    for (size_t i = 0; i < 4; ++i) right = right && line_[body + 2 + i] == hex_digit(crc >> (12 - 4 * i));
    return right;
  }

  // True: the line was accepted and answered, and is a sign of life.
  bool execute(char command, Words words) {
    const char name[2] = {command, 0};
    if (!words.is(name)) return refuse(kMalformed, "unknown line");
    switch (command) {
      case 'H':
        return hello(words);
      case 'C':
        return limit(words);
      case 'W':
        return watch(words);
      case 'E':
        return enable(words);
      case 'P':
        return aim(words);
      case 'S':
      case 'R':
      case 'Q':
        break;
      default:
        return refuse(kMalformed, "unknown line");
    }
    if (!words.done()) return refuse(kMalformed, "S, R and Q are alone in their line");
    if (command == 'Q') return send_state();
    if (command == 'S') freeze_all();
    if (command == 'R') relax_all();
    return acknowledge(name);
  }

  bool hello(Words words) {
    uint32_t version = 0, nonce = 0;
    if (!words.number(version)) return refuse(kMalformed, "H needs a version");
    if (version != kProtocol) return refuse(kVersionRefused, "this firmware speaks version ", kProtocol);
    if (!words.number(nonce, 16) || !words.done()) return refuse(kMalformed, "H needs a version and a nonce");
    greeted_ = true;
    return send_identity(nonce);
  }

  bool limit(Words words) {
    uint32_t index = 0, min = 0, max = 0, speed = 0, acceleration = 0;
    const bool whole = words.number(index) && words.number(min) && words.number(max) && words.number(speed) &&
                       words.number(acceleration) && words.done();
    if (!greeted_) return refuse(kNoHello, "no H since the start");
    if (!whole) return refuse(kMalformed, "C needs channel, min, max, speed, acceleration");
    if (index >= config_.channels) return refuse(kOutOfRange, "channels: ", config_.channels);
    if (min < kMinPulse || max > kMaxPulse || min >= max)
      return refuse(kOutOfRange, "300 <= min < max <= 3000 us");
    if (speed == 0 || speed > kMaxSpeed) return refuse(kOutOfRange, "speed in us/s is 1 to ", kMaxSpeed);
    if (acceleration == 0 || acceleration > kMaxAcceleration)
      return refuse(kOutOfRange, "acceleration in us/s^2 is 1 to ", kMaxAcceleration);
    Channel& channel = channels_[index];
    const bool same = channel.limited && channel.ramp.has_limits(min, max, speed, acceleration);
    if (channel.live && !same && !(channel.ramp.at_rest() && channel.ramp.allows(min, max)))
      return refuse(kChannelBusy, "other limits need rest, and a pulse inside them: channel ", index);
    if (!same) channel.ramp.set_limits(min, max, speed, acceleration);
    channel.limited = true;
    Line line;
    return send(line.text("A C ").number(index));
  }

  bool watch(Words words) {
    uint32_t timeout = 0;
    const bool number = words.number(timeout);
    Words other = words;
    const bool hold = words.is("hold") && words.done(), relax = other.is("relax") && other.done();
    if (!greeted_) return refuse(kNoHello, "no H since the start");
    if (!number || (!hold && !relax)) return refuse(kMalformed, "W needs ms, and hold or relax");
    if (timeout < kMinWatchdog || timeout > kMaxWatchdog) return refuse(kOutOfRange, "W is 20 to 10000 ms");
    timeout_ = timeout;
    relaxes_ = relax;
    return acknowledge("W");
  }

  bool enable(Words words) {
    uint32_t mask = 0;
    if (!words.number(mask) || !words.done()) return refuse(kMalformed, "E needs a mask");
    if (!greeted_) return refuse(kNoHello, "no H since the start");
    if (mask >> config_.channels != 0) return refuse(kOutOfRange, "channels: ", config_.channels);
    for (uint8_t i = 0; i < config_.channels; ++i) {
      if ((mask >> i & 1) != 0 && !channels_[i].limited) return refuse(kNoLimits, "no C for channel ", i);
    }
    if (board_.stop_pin()) return refuse(kStopPinActive, "the stop pin is active");
    if (supply_lost_) return refuse(kNoSupply, "the servos have no supply");
    latched_ = 0;
    for (uint8_t i = 0; i < config_.channels; ++i) {
      if ((mask >> i & 1) != 0) {
        channels_[i].enabled = true;
      } else {
        relax(i);
      }
    }
    Line line;
    return send(line.text("A E ").number(mask));
  }

  bool aim(Words words) {
    uint32_t sequence = 0;
    uint32_t targets[kMaxChannels] = {};  // 0: keep
    if (!words.number(sequence)) return refuse(kMalformed, "P needs a sequence number");
    for (uint8_t i = 0; i == 0 || !words.done(); ++i) {
      if (i == config_.channels) return refuse(kOutOfRange, "channels: ", config_.channels);
      if (words.keeps()) {
        words.is("-");
      } else if (!words.number(targets[i]) || targets[i] == 0) {
        return refuse(kMalformed, "a target is a width in us, or -");
      }
    }
    sequence_ = sequence;
    for (uint8_t i = 0; latched_ == 0 && i < config_.channels; ++i) {
      if (channels_[i].enabled && targets[i] != 0) aim(channels_[i], targets[i], i);
    }
    return send_state();
  }

  void aim(Channel& channel, uint32_t target, uint8_t index) {
    const uint32_t inside = channel.ramp.clamped(target);
    channel.clamped = inside != target;
    if (channel.live) {
      channel.ramp.aim(inside);
    } else {
      channel.ramp.begin(inside);
      channel.live = true;
      write_pulse(index);
    }
  }

  // -- motion

  void write_pulse(uint8_t index) {
    Channel& channel = channels_[index];
    const uint32_t width = channel.live ? channel.ramp.nanoseconds() : 0;
    if (width != channel.written) board_.pulse(index, width);
    channel.written = width;
  }

  void freeze_all() {
    for (uint8_t i = 0; i < config_.channels; ++i) {
      if (channels_[i].live) channels_[i].ramp.freeze();
    }
  }

  void relax(uint8_t index) {
    channels_[index].enabled = channels_[index].live = channels_[index].clamped = false;
    write_pulse(index);
  }

  void relax_all() {
    for (uint8_t i = 0; i < config_.channels; ++i) relax(i);
  }

  // -- what is watched

  void watch_stop_pin() {
    if (!board_.stop_pin() || (latched_ & kStopPin) != 0) return;
    latched_ |= kStopPin;
    freeze_all();
    send_event(kStopped, "stop pin");
  }

  void watch_silence(uint32_t now) {
    if (enabled_mask() == 0 || (latched_ & kWatchdog) != 0 || now - heard_ <= timeout_) return;
    latched_ |= kWatchdog;
    if (relaxes_) {
      relax_all();
    } else {
      freeze_all();
    }
    send_event(kSilence, relaxes_ ? "relaxed after silence, ms: " : "held after silence, ms: ", timeout_);
  }

  void watch_supply() {
    const int32_t supply = board_.millivolts();
    if (supply < 0) return;
    const bool good = supply >= config_.brown_out_mv + config_.hysteresis_mv;
    const bool low = supply_low_ ? !good : supply < config_.brown_out_mv;
    const bool lost = supply_lost_ ? !good : supply < config_.lost_mv;
    if (low == supply_low_ && lost == supply_lost_) {
      supply_readings_ = 0;
      return;
    }
    if (++supply_readings_ < kSupplyReadings) return;
    supply_readings_ = 0;
    const bool worse = (low && !supply_low_) || (lost && !supply_lost_);
    const bool moved_by_hand = lost && !supply_lost_;  // from now on the pose is unknown
    supply_low_ = low;
    supply_lost_ = lost;
    if (worse) send_supply_event(supply);
    if (moved_by_hand) begin_again();
  }

  // Everything is as after a start: servos without power keep no pose.
  void begin_again() {
    relax_all();
    for (uint8_t i = 0; i < config_.channels; ++i) channels_[i].limited = false;
    greeted_ = false;
    timeout_ = kDefaultWatchdog;
    relaxes_ = false;
    new_boot();
    send_identity(0);
  }

  void report_dropped(uint32_t now) {
    if (dropped_ == reported_ || now - reported_when_ < kDroppedReportPeriod) return;
    reported_ = dropped_;
    reported_when_ = now;
    send_event(kLinesDropped, "damaged lines since the start: ", dropped_);
  }

  // -- answers

  bool send(Line& line) {
    line.close();
    board_.send(line.bytes(), line.size());
    return true;
  }

  bool acknowledge(const char* command) {
    Line line;
    return send(line.text("A ").text(command));
  }

  static Line& fault(Line& line, Code code, const char* text) {
    return line.text("! ").number(static_cast<uint32_t>(code)).text(" ").text(text);
  }

  bool refuse(Code code, const char* text) {
    Line line;
    send(fault(line, code, text));
    return false;
  }

  bool refuse(Code code, const char* text, uint32_t number) {
    Line line;
    send(fault(line, code, text).number(number));
    return false;
  }

  void send_event(Code code, const char* text) { refuse(code, text); }
  void send_event(Code code, const char* text, uint32_t number) { refuse(code, text, number); }

  void send_supply_event(int32_t supply) {
    send_event(supply_lost_ ? kSupplyLost : kSupplyLow,
               supply_lost_ ? "supply lost, mV: " : "supply low, mV: ", static_cast<uint32_t>(supply));
  }

  bool send_identity(uint32_t nonce) {
    Line line;
    line.text("I doppel-servo ").number(kProtocol).text(" ").number(config_.channels).text(" ");
    line.hex(boot_).text(" ").hex(nonce).text(" ").text(firmware_version()).text(" ").number(config_.step_ns);
    return send(line);
  }

  bool send_state() {
    const int32_t supply = board_.millivolts();
    Line line;
    line.text("T ")
        .number(sequence_)
        .text(" ")
        .number(board_.milliseconds())
        .text(" ")
        .number(flags())
        .text(" ");
    line.number(supply < 0 ? 0U : supply == 0 ? 1U : supply > 65535 ? 65535U : static_cast<uint32_t>(supply));
    for (uint8_t i = 0; i < config_.channels; ++i)
      line.text(" ").number(channels_[i].live ? channels_[i].ramp.microseconds() : 0);
    if (config_.inputs > 0) line.text(" a");
    for (uint8_t i = 0; i < config_.inputs; ++i) line.text(" ").number(board_.analog(i));
    return send(line);
  }

  Board& board_;
  Config config_;
  Channel channels_[kMaxChannels];
  char line_[kMaxLine];
  size_t size_ = 0;
  bool too_long_ = false;  // the rest of this line is dropped
  bool started_ = false;
  bool greeted_ = false;  // by `H`
  bool relaxes_ = false;  // after silence
  bool supply_low_ = false, supply_lost_ = false;
  uint8_t supply_readings_ = 0;
  uint32_t latched_ = 0;  // kWatchdog, kStopPin
  uint32_t boot_ = 0, sequence_ = 0;
  uint32_t timeout_ = kDefaultWatchdog;
  uint32_t heard_ = 0, ticked_ = 0, written_ = 0;
  uint32_t dropped_ = 0, reported_ = 0, reported_when_ = 0;
};

}  // namespace doppel_servo
