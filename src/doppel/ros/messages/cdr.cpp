#include "doppel/ros/messages/detail/cdr.h"

#include <fmt/format.h>

#include <algorithm>

namespace doppel {

namespace {

// The name of an unsupported representation identifier (RTPS 2.5, clause 10.2); nullptr: plain CDR, the only
// one in ROS 2.
const char* why_not_plain(std::byte first, std::byte second) {
  const auto id = std::to_integer<unsigned>(second);
  if (first != std::byte{0}) return "the encapsulation is unknown";
  if (id <= 1) return nullptr;
  if (id <= 3) return "the encapsulation is a parameter list (PL_CDR), not plain CDR (00 00 or 00 01)";
  if (id >= 6 && id <= 11) return "the encapsulation is XCDR version 2, not plain CDR (00 00 or 00 01)";
  return "the encapsulation is not plain CDR (00 00 or 00 01)";
}

}  // namespace

CdrReader::CdrReader(std::span<const std::byte> bytes) {
  if (bytes.size() < kCdrHeaderSize) {
    fail("the encapsulation header of four bytes is missing");
    return;
  }
  body_ = bytes.subspan(kCdrHeaderSize);
  if (const char* why = why_not_plain(bytes[0], bytes[1]); why != nullptr) {
    fail(why);
    return;
  }
  swap_ = bytes[1] == std::byte{0};
}

bool CdrReader::align(std::size_t alignment) {
  if (!ok()) return false;
  const std::size_t aligned = cdr_aligned(position_, alignment);
  if (aligned > body_.size()) return fail("the data is truncated");
  position_ = aligned;
  return true;
}

void CdrReader::swap_each(std::byte* values, std::size_t width, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) std::reverse(values + i * width, values + (i + 1) * width);
}

bool CdrReader::boolean(bool& value) {
  std::uint8_t byte = 0;
  if (!number(byte)) return false;
  if (byte > 1) return fail("a bool is neither 0 nor 1");
  value = byte == 1;
  return true;
}

bool CdrReader::text(std::string_view& text) {
  std::uint32_t size = 0;
  if (!length(size, 1)) return false;
  if (size == 0) {  // invalid in CDR, but some writers encode an empty string without its NUL
    text = {};
    return true;
  }
  const auto* chars = reinterpret_cast<const char*>(body_.data() + position_);
  position_ += size;
  text = {chars, chars[size - 1] == '\0' ? size - 1 : size};
  return true;
}

bool CdrReader::wide_text(std::u16string& text) {
  std::uint32_t size = 0;
  if (!length(size, sizeof(std::uint32_t))) return false;
  text.resize(size);
  for (char16_t& unit : text) {
    std::uint32_t wide = 0;
    if (!number(wide)) return false;
    if (wide > 0xFFFF) return fail("a wide character is not valid UTF-16");
    unit = static_cast<char16_t>(wide);
  }
  return true;
}

bool CdrReader::length(std::uint32_t& count, std::size_t least_size, std::size_t bound) {
  if (!number(count)) return false;
  if (count > (body_.size() - position_) / least_size) return fail("a length exceeds the remaining data");
  if (bound > 0 && count > bound) return fail("a sequence is longer than its bound");
  return true;
}

bool CdrReader::finish() {
  if (!ok()) return false;
  const std::size_t rest = body_.size() - position_;
  if (rest > 3 || (rest > 0 && body_.size() % 4 != 0))
    return fail("there is data after the end of the message");
  return true;
}

bool CdrReader::fail(const char* why) {
  if (why_ == nullptr) why_ = why;
  return false;
}

void CdrReader::within(std::string_view field) {
  path_ = path_.empty() ? std::string(field) : fmt::format("{}.{}", field, path_);
}

Status CdrReader::status(std::string_view type_name) const {
  if (ok()) return {};
  const std::string where = path_.empty() ? std::string() : fmt::format(" in '{}'", path_);
  return Status::refused(fmt::format("not a {}: {}{} (byte {} of {})", type_name, why_, where,
                                     kCdrHeaderSize + position_, kCdrHeaderSize + body_.size()));
}

}  // namespace doppel
