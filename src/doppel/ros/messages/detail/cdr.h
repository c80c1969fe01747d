#pragma once
// The primitives of CDR (OMG XCDR version 1, DDS-XTypes 1.3 clause 7.4.3): alignment, numbers and strings,
// independent of messages. Offsets for alignment begin after the four-byte encapsulation header.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/export.h"

namespace doppel {

using Bytes = std::vector<std::byte>;

static_assert(std::endian::native == std::endian::little, "the writers copy numbers without byte swapping");

constexpr std::size_t kCdrHeaderSize = 4;
constexpr std::byte kCdrLittleEndianHeader[kCdrHeaderSize] = {std::byte{0}, std::byte{1}, std::byte{0},
                                                              std::byte{0}};

constexpr std::size_t cdr_aligned(std::size_t position, std::size_t alignment) {
  return (position + alignment - 1) & ~(alignment - 1);
}

// As in rmw_fastrtps: the number of UTF-16 units, then each in four bytes, without a NUL.
template <class Sink>
void put_wide_text(Sink& sink, std::u16string_view text) {
  sink.number(static_cast<std::uint32_t>(text.size()));
  for (const char16_t unit : text) sink.number(static_cast<std::uint32_t>(unit));
}

// Counts the bytes that a CdrWriter would write.
class DOPPEL_API CdrSizer {
 public:
  template <class T>
  void number(T) {
    position_ = cdr_aligned(position_, sizeof(T)) + sizeof(T);
  }
  template <class T>
  void numbers(const T*, std::size_t count) {
    if (count > 0) position_ = cdr_aligned(position_, sizeof(T)) + count * sizeof(T);
  }
  void text(std::string_view text) {
    number(std::uint32_t{});
    position_ += text.size() + 1;
  }
  void wide_text(std::u16string_view text) {
    number(std::uint32_t{});
    position_ += text.size() * sizeof(std::uint32_t);
  }
  [[nodiscard]] std::size_t size() const { return kCdrHeaderSize + position_; }

 private:
  std::size_t position_ = 0;
};

// Writes into memory that a CdrSizer has measured.
class DOPPEL_API CdrWriter {
 public:
  explicit CdrWriter(std::byte* out) : body_(out + kCdrHeaderSize) {
    std::memcpy(out, kCdrLittleEndianHeader, kCdrHeaderSize);
  }
  template <class T>
  void number(T value) {
    numbers(&value, 1);
  }
  template <class T>
  void numbers(const T* values, std::size_t count) {
    if (count == 0) return;
    align(sizeof(T));
    std::memcpy(body_ + position_, values, count * sizeof(T));
    position_ += count * sizeof(T);
  }
  void text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    std::memcpy(body_ + position_, text.data(), text.size());
    position_ += text.size();
    body_[position_++] = std::byte{0};
  }
  void wide_text(std::u16string_view text) { put_wide_text(*this, text); }

 private:
  void align(std::size_t alignment) {
    const std::size_t aligned = cdr_aligned(position_, alignment);
    while (position_ < aligned) body_[position_++] = std::byte{0};  // so that equal messages have equal bytes
  }
  std::byte* body_;
  std::size_t position_ = 0;
};

// Appends to a buffer that grows; for conversions, not for the loop.
class DOPPEL_API CdrAppender {
 public:
  explicit CdrAppender(Bytes& out) : out_(out) {
    out_.assign(kCdrLittleEndianHeader, kCdrLittleEndianHeader + kCdrHeaderSize);
  }
  template <class T>
  void number(T value) {
    out_.resize(kCdrHeaderSize + cdr_aligned(size(), sizeof(T)));
    append(&value, sizeof(T));
  }
  void text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    append(text.data(), text.size());
    out_.push_back(std::byte{0});
  }
  void wide_text(std::u16string_view text) { put_wide_text(*this, text); }
  [[nodiscard]] std::size_t size() const { return out_.size() - kCdrHeaderSize; }

 private:
  void append(const void* data, std::size_t count) {
    const auto* bytes = static_cast<const std::byte*>(data);
    out_.insert(out_.end(), bytes, bytes + count);
  }
  Bytes& out_;
};

// Reads both byte orders; every read is checked, and the first that fails leaves its reason in problem().
class DOPPEL_API CdrReader {
 public:
  explicit CdrReader(std::span<const std::byte> bytes);

  template <class T>
  bool number(T& value) {
    return numbers(&value, 1);
  }
  template <class T>
  bool numbers(T* values, std::size_t count) {
    if (count == 0) return ok();
    if (!align(sizeof(T)) || count > (body_.size() - position_) / sizeof(T))
      return fail("the data is truncated");
    std::memcpy(values, body_.data() + position_, count * sizeof(T));
    position_ += count * sizeof(T);
    if (swap_ && sizeof(T) > 1) swap_each(reinterpret_cast<std::byte*>(values), sizeof(T), count);
    return true;
  }
  bool boolean(bool& value);
  // With or without a final NUL, as in Fast CDR; Cyclone DDS and others always send one.
  bool text(std::string_view& text);
  bool wide_text(std::u16string& text);
  // The number of elements of a sequence of which each takes at least `least_size` bytes, and which has at
  // most `bound` (0: any number).
  bool length(std::uint32_t& count, std::size_t least_size, std::size_t bound = 0);
  // At the end of the message only RTPS's padding of the whole to a multiple of four bytes may follow.
  bool finish();

  bool fail(const char* why);
  // Called after a failed read for each enclosing field, innermost first.
  void within(std::string_view field);
  [[nodiscard]] bool ok() const { return why_ == nullptr; }
  [[nodiscard]] Status status(std::string_view type_name) const;

 private:
  bool align(std::size_t alignment);
  static void swap_each(std::byte* values, std::size_t width, std::size_t count);

  std::span<const std::byte> body_;
  std::size_t position_ = 0;
  bool swap_ = false;
  const char* why_ = nullptr;
  std::string path_;
};

}  // namespace doppel
