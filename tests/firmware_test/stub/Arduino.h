#pragma once
// The part of the Arduino core for ESP32 that the sketch uses, for a compiler without one. Both generations
// of the LEDC functions are declared, as overloads in two namespaces: the sketch of one generation sees only
// its own.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

#define CONFIG_IDF_TARGET_ESP32 1
#define HIGH 1
#define LOW 0
#define INPUT_PULLUP 5

namespace stub {

struct Machine {
  std::uint32_t now = 5;
  std::map<int, int> levels;              // of pins; default LOW
  std::map<int, std::uint32_t> duty;      // of LEDC, by pin (core 3) or channel (core 2)
  std::map<int, int> bits, attached;      // attached: pin -> channel
  std::map<int, std::uint8_t> registers;  // of the PCA9685
  std::deque<std::uint8_t> received;
  std::string sent;
  int millivolts = 0;
};
inline Machine& machine() {
  static Machine only;
  return only;
}

struct Port {
  void begin(unsigned long) {}
  int available() { return static_cast<int>(machine().received.size()); }
  int read() {
    const std::uint8_t byte = machine().received.front();
    machine().received.pop_front();
    return byte;
  }
  std::size_t write(const std::uint8_t* bytes, std::size_t size) {
    machine().sent.append(reinterpret_cast<const char*>(bytes), size);
    return size;
  }
};

struct TwoWire {
  bool begin(int, int) { return true; }
  bool setClock(std::uint32_t) { return true; }
  void beginTransmission(int address) {
    address_ = address;
    bytes_.clear();
  }
  std::size_t write(const std::uint8_t* bytes, std::size_t size) {
    bytes_.append(reinterpret_cast<const char*>(bytes), size);
    return size;
  }
  std::uint8_t endTransmission() {
    for (std::size_t i = 1; address_ == 0x40 && i < bytes_.size(); ++i)
      machine().registers[static_cast<std::uint8_t>(bytes_[0]) + static_cast<int>(i) - 1] =
          static_cast<std::uint8_t>(bytes_[i]);
    return 0;
  }

 private:
  int address_ = 0;
  std::string bytes_;
};

namespace core2 {
inline double ledcSetup(std::uint8_t channel, double, std::uint8_t bits) {
  machine().bits[channel] = bits;
  return 50;
}
inline void ledcAttachPin(std::uint8_t pin, std::uint8_t channel) {
  machine().attached[pin] = channel;
}
inline void ledcWrite(std::uint8_t channel, std::uint32_t duty) {
  machine().duty[channel] = duty;
}
}  // namespace core2

namespace core3 {
inline bool ledcAttach(std::uint8_t pin, std::uint32_t, std::uint8_t bits) {
  machine().bits[pin] = bits;
  return true;
}
inline bool ledcWrite(std::uint8_t pin, std::uint32_t duty) {
  machine().duty[pin] = duty;
  return true;
}
}  // namespace core3

}  // namespace stub

[[gnu::unused]] static stub::Port Serial;
[[gnu::unused]] static stub::TwoWire Wire;
inline unsigned long millis() {
  return stub::machine().now;
}
inline void delay(std::uint32_t milliseconds) {
  stub::machine().now += milliseconds;
}
inline std::uint32_t esp_random() {
  return 0x1234ABCD;
}
inline void pinMode(std::uint8_t, std::uint8_t) {}
inline int digitalRead(std::uint8_t pin) {
  return stub::machine().levels[pin];
}
inline std::uint16_t analogRead(std::uint8_t pin) {
  return pin;
}
inline std::uint32_t analogReadMilliVolts(std::uint8_t) {
  return static_cast<std::uint32_t>(stub::machine().millivolts);
}
