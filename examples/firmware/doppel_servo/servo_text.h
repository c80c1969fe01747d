#pragma once
// The text of the line protocol: the check, lines that are written, words that are read.

#include <stddef.h>
#include <stdint.h>
#include <string.h>

namespace doppel_servo {

constexpr size_t kMaxLine = 128;  // bytes with the newline

// CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF.
inline uint16_t crc16(const char* bytes, size_t size) {
  uint32_t crc = 0xFFFF;
  for (size_t i = 0; i < size; ++i) {
    crc ^= static_cast<uint32_t>(static_cast<uint8_t>(bytes[i])) << 8;
    for (int bit = 0; bit < 8; ++bit)
      crc = ((crc & 0x8000U) != 0 ? (crc << 1) ^ 0x1021U : crc << 1) & 0xFFFFU;
  }
  return static_cast<uint16_t>(crc);
}

inline char hex_digit(uint32_t value) {
  return "0123456789ABCDEF"[value & 0xF];
}

// A line that is being written. Text that does not fit is dropped: the check always has room.
class Line {
 public:
  Line& text(const char* word) {
    for (; *word != 0; ++word) add(*word);
    return *this;
  }
  Line& number(uint32_t value) {
    char digits[10];
    size_t count = 0;
    do {
      digits[count++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value != 0);
    while (count > 0) add(digits[--count]);
    return *this;
  }
  Line& hex(uint32_t value, int digits = 8) {
    for (int i = digits - 1; i >= 0; --i) add(hex_digit(value >> (4 * i)));
    return *this;
  }
  // Adds the check and the end.
  Line& close() {
    const uint16_t crc = crc16(bytes_, size_);
    room_ = kMaxLine;
    return text(" *").hex(crc, 4).text("\n");
  }
  const char* bytes() const { return bytes_; }
  size_t size() const { return size_; }

 private:
  void add(char byte) {
    if (size_ < room_) bytes_[size_++] = byte;
  }

  char bytes_[kMaxLine];
  size_t size_ = 0;
  size_t room_ = kMaxLine - 7;  // " *CCCC\n"
};

// The words of a body, separated by one space each. No word is read as 0 that is not a zero.
class Words {
 public:
  Words(const char* begin, const char* end) : next_(begin), end_(end), more_(true) {}
  bool done() const { return !more_; }
  bool is(const char* expected) {
    const char *word = nullptr, *stop = nullptr;
    take(word, stop);
    const size_t size = strlen(expected);
    return static_cast<size_t>(stop - word) == size && memcmp(word, expected, size) == 0;
  }
  // The next word is "-".
  bool keeps() const {
    return more_ && next_ != end_ && *next_ == '-' && (next_ + 1 == end_ || next_[1] == ' ');
  }
  bool number(uint32_t& out, uint32_t base = 10) {
    const char *word = nullptr, *stop = nullptr;
    take(word, stop);
    if (word == stop) return false;
    uint64_t value = 0;
    for (; word != stop; ++word) {
      const uint32_t digit = digit_of(*word);
      if (digit >= base) return false;
      value = value * base + digit;
      if (value > 0xFFFFFFFFU) return false;
    }
    out = static_cast<uint32_t>(value);
    return true;
  }

 private:
  static uint32_t digit_of(char letter) {
    if (letter >= '0' && letter <= '9') return static_cast<uint32_t>(letter - '0');
    if (letter >= 'A' && letter <= 'F') return static_cast<uint32_t>(letter - 'A') + 10;
    if (letter >= 'a' && letter <= 'f') return static_cast<uint32_t>(letter - 'a') + 10;
    return 99;
  }
  void take(const char*& word, const char*& stop) {
    word = stop = next_;
    while (stop != end_ && *stop != ' ') ++stop;
    more_ = stop != end_;
    next_ = more_ ? stop + 1 : stop;
  }

  const char *next_, *end_;
  bool more_;
};

}  // namespace doppel_servo
