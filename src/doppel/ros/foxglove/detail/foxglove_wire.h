#pragma once
// Common to both halves of the protocol: little-endian numbers, and JSON that is checked while it is read.

#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "doppel/ros/foxglove/foxglove_protocol.h"

namespace doppel::foxglove::wire {

using nlohmann::json;

struct Malformed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Invalid UTF-8 becomes U+FFFD: names come from users' files.
inline std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

// The frame as an object with a text field "op".
json parse_object(std::string_view frame, std::string& op);
const json& member(const json& object, const char* name);
const json& list(const json& object, const char* name);
std::string text(const json& object, const char* name);
std::string text_or(const json& object, const char* name, std::string otherwise);
std::uint32_t id(const json& value, const char* what);
inline std::uint32_t id_of(const json& object, const char* name) {
  return id(member(object, name), name);
}
std::vector<std::uint32_t> ids(const json& object, const char* name);
// A frame with only a list of ids, as sent by both ends.
inline std::string ids_frame(const char* op, const char* name, const std::vector<std::uint32_t>& ids) {
  return dump({{"op", op}, {name, ids}});
}
std::vector<std::string> texts(const json& object, const char* name);
json parameters_to_json(const std::vector<Parameter>& parameters);
std::vector<Parameter> parameters_from_json(const json& object);

// Binary frames, read from the front.
class Reader {
 public:
  explicit Reader(ByteView bytes) : rest_(bytes) {}
  template <class T>
  T number() {
    T value{};
    const ByteView raw = take(sizeof(T));
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  std::string text() {
    const ByteView raw = take(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(raw.data()), raw.size()};
  }
  ByteView take(std::size_t size) {
    if (size > rest_.size()) throw Malformed("the frame is truncated");
    const ByteView taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }
  [[nodiscard]] ByteView rest() const { return rest_; }

 private:
  ByteView rest_;
};

class Writer {
 public:
  explicit Writer(std::uint8_t opcode, std::size_t expected_size) {
    bytes_.reserve(expected_size);
    number(opcode);
  }
  template <class T>
  Writer& number(T value) {
    return raw(std::as_bytes(std::span(&value, 1)));
  }
  Writer& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    return raw(std::as_bytes(std::span(value.data(), value.size())));
  }
  Writer& raw(ByteView value) {
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    return *this;
  }
  FrameBytes done() { return std::move(bytes_); }

 private:
  FrameBytes bytes_;
};

}  // namespace doppel::foxglove::wire
