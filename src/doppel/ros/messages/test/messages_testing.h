#pragma once
// Helpers of the messages' tests: bytes in hexadecimal, and random messages of any described type.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "doppel/base/core/utf8.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/detail/cdr.h"
#include "doppel/ros/messages/type_description.h"

namespace doppel::messages_testing {

inline unsigned new_seed() {
  const unsigned seed = 33;
  std::printf("seed %u\n", seed);
  return seed;
}

inline Bytes hex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] == ' ') continue;
    bytes.push_back(static_cast<std::byte>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
    ++i;
  }
  return bytes;
}

inline std::string show(const Bytes& bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte b : bytes) {
    text += kDigits[static_cast<std::size_t>(b) >> 4];
    text += kDigits[static_cast<std::size_t>(b) & 15];
    text += ' ';
  }
  return text;
}

// Messages, the parts of services and actions, and the events of services.
inline std::vector<const TypeSupport*> all_types() {
  std::vector<const TypeSupport*> types;
  for (const std::string& name : type_names()) types.push_back(find_type(name));
  for (const std::string& name : service_names()) {
    types.push_back(find_service(name)->request);
    types.push_back(find_service(name)->response);
    types.push_back(find_type(name + "_Event"));
  }
  for (const std::string& name : action_names()) {
    const ActionSupport* action = find_action(name);
    types.insert(types.end(),
                 {action->goal, action->result, action->feedback, find_type(name + "_FeedbackMessage")});
  }
  return types;
}

class RandomMessage {
 public:
  RandomMessage(Bytes& out, std::mt19937& random) : out_(out), random_(random) {}

  void message(const TypeDescription& type) {
    if (type.fields.empty()) out_.number(std::uint8_t{0});
    for (const FieldDescription& field : type.fields) {
      std::size_t count = field.count;
      if (field.shape == FieldShape::sequence) {
        count = random_() % (field.bound > 0 ? std::min<std::size_t>(field.bound + 1, 4) : 4);
        out_.number(static_cast<std::uint32_t>(count));
      }
      for (std::size_t i = 0; i < count; ++i) element(field);
    }
  }

 private:
  void element(const FieldDescription& field) {
    const auto bits = static_cast<std::uint64_t>(random_()) << 32 | random_();
    switch (field.kind) {
      case FieldKind::message:
        return message(*field.type);
      case FieldKind::text:
        return out_.text(text());
      case FieldKind::wide_text:
        return out_.wide_text(to_utf16(text()));
      case FieldKind::boolean:
        return out_.number(static_cast<std::uint8_t>(bits & 1));
      case FieldKind::int8:
      case FieldKind::byte:
      case FieldKind::character:
      case FieldKind::uint8:
        return out_.number(static_cast<std::uint8_t>(bits));
      case FieldKind::int16:
      case FieldKind::wide_character:
      case FieldKind::uint16:
        return out_.number(static_cast<std::uint16_t>(bits));
      case FieldKind::int32:
      case FieldKind::uint32:
        return out_.number(static_cast<std::uint32_t>(bits));
      case FieldKind::int64:
      case FieldKind::uint64:
        return out_.number(bits);
      case FieldKind::float32:
        return out_.number(static_cast<float>(real(bits)));
      case FieldKind::float64:
        return out_.number(real(bits));
    }
  }

  double real(std::uint64_t bits) {
    const double special[] = {0.0, -0.0, 1.0, 1e-5, 1e16, 123456.789, INFINITY, -INFINITY, 1e-30, 0.1};
    if (bits % 3 == 0) return special[(bits >> 8) % std::size(special)];
    return std::uniform_real_distribution<double>(-1e6, 1e6)(random_);
  }

  std::string text() {
    const char* const samples[] = {"",
                                   "1",
                                   "true",
                                   "null",
                                   " a",
                                   "a ",
                                   "a: b",
                                   "it's",
                                   "- x",
                                   "#c",
                                   "~",
                                   "x\ny",
                                   "x\n\n  y",
                                   "\t",
                                   "\"",
                                   "Gelenk \xC3\xA4",
                                   "\xF0\x9F\xA4\x96",
                                   "0x1F",
                                   "1e5",
                                   "---",
                                   "a #b",
                                   "\x01\\",
                                   "[",
                                   "{a: 1}",
                                   "2024-01-01",
                                   "\n",
                                   "a\n",
                                   "\xC2\x85",
                                   "=",
                                   "<<",
                                   "'",
                                   "%",
                                   "@x",
                                   "\r\n",
                                   "1:30"};
    if (random_() % 2 == 0) return samples[random_() % std::size(samples)];
    std::string text;
    for (std::size_t n = random_() % 12; n > 0; --n) text += static_cast<char>(32 + random_() % 95);
    return text;
  }

  CdrAppender out_;
  std::mt19937& random_;
};

inline Bytes random_message(const TypeDescription& type, std::mt19937& random) {
  Bytes bytes;
  RandomMessage(bytes, random).message(type);
  return bytes;
}

}  // namespace doppel::messages_testing
