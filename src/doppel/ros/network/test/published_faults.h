#pragma once
// Datagrams with the published faults of DDS implementations, from the descriptions of their advisories and
// fixes: bounded in size, and harmless for a receiver that checks what it reads. All are little endian.

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

namespace doppel::ros2_testing {

using Octets = std::vector<std::uint8_t>;
using Prefix = std::array<std::uint8_t, 12>;  // the sender
using Entity = std::array<std::uint8_t, 4>;

inline constexpr Entity kAnyReader{0, 0, 0, 0}, kParticipants{0, 1, 0, 0xc2}, kWriters{0, 0, 3, 0xc2},
    kReaders{0, 0, 4, 0xc2}, kSecurity{0, 2, 1, 0xc3}, kUserWriter{0, 0, 0x12, 0x03};

inline void put(Octets& bytes, std::uint64_t value, int width) {
  for (int i = 0; i < width; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
inline void put(Octets& bytes, const Octets& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}
inline Octets words(std::initializer_list<std::uint32_t> values) {
  Octets bytes;
  for (const std::uint32_t value : values) put(bytes, value, 4);
  return bytes;
}
// A length and a text with its zero byte, padded.
inline Octets text(const std::string& content) {
  Octets bytes = words({static_cast<std::uint32_t>(content.size() + 1)});
  bytes.insert(bytes.end(), content.begin(), content.end());
  bytes.resize(4 + (content.size() + 4) / 4 * 4);
  return bytes;
}

// A datagram under construction.
class RtpsPacket {
 public:
  explicit RtpsPacket(const Prefix& sender) : bytes_{'R', 'T', 'P', 'S', 2, 3, 1, 15} {
    bytes_.insert(bytes_.end(), sender.begin(), sender.end());
  }
  RtpsPacket& submessage(std::uint8_t kind, std::uint8_t flags, const Octets& body) {
    bytes_.insert(bytes_.end(), {kind, static_cast<std::uint8_t>(flags | 1)});
    put(bytes_, body.size(), 2);
    put(bytes_, body);
    return *this;
  }
  // A sample without inline QoS.
  RtpsPacket& data(const Entity& writer, std::uint32_t sequence, const Octets& payload) {
    return submessage(0x15, 0x04, data_body(writer, sequence, 16, payload));
  }
  // DATA from its reader on; `offset` is the distance to the payload that it declares.
  static Octets data_body(const Entity& writer, std::uint32_t sequence, std::uint32_t offset,
                          const Octets& payload) {
    Octets body;
    put(body, 0, 2);
    put(body, offset, 2);
    put(body, {kAnyReader.begin(), kAnyReader.end()});
    put(body, {writer.begin(), writer.end()});
    put(body, words({0, sequence}));
    put(body, payload);
    return body;
  }
  RtpsPacket& fragment(const Entity& writer, std::uint32_t sequence, std::uint32_t first, std::uint32_t count,
                       std::uint32_t size, std::uint32_t whole, const Octets& payload,
                       std::uint8_t flags = 0x04) {
    Octets rest = words({first});
    put(rest, count, 2);
    put(rest, size, 2);
    put(rest, whole, 4);
    put(rest, payload);
    return submessage(0x16, flags, data_body(writer, sequence, 28, rest));
  }
  // HEARTBEAT (7) and GAP (8): two sequence numbers and one more word.
  RtpsPacket& range(std::uint8_t kind, const Entity& writer, std::int64_t first, std::int64_t second,
                    std::uint32_t last_word) {
    Octets body(kAnyReader.begin(), kAnyReader.end());
    put(body, {writer.begin(), writer.end()});
    for (const std::int64_t sequence : {first, second})
      put(body, words({static_cast<std::uint32_t>(sequence >> 32), static_cast<std::uint32_t>(sequence)}));
    put(body, last_word, 4);
    return submessage(kind, 0, body);
  }
  [[nodiscard]] const Octets& bytes() const { return bytes_; }

 private:
  Octets bytes_;
};

// A list of parameters as the payload of an announcement.
class Announcement {
 public:
  Announcement& with(std::uint16_t id, const Octets& value) {
    put(bytes_, id, 2);
    put(bytes_, (value.size() + 3) / 4 * 4, 2);
    put(bytes_, value);
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    return *this;
  }
  [[nodiscard]] Octets end() const {
    Octets all = bytes_;
    put(all, words({1}));
    return all;
  }

 private:
  Octets bytes_{0, 3, 0, 0};
};

inline Octets guid(const Prefix& sender, const Entity& entity) {
  Octets bytes(sender.begin(), sender.end());
  put(bytes, {entity.begin(), entity.end()});
  return bytes;
}
inline Octets address_on_loopback(std::uint32_t port) {
  Octets bytes = words({1, port});
  bytes.resize(20);
  put(bytes, {127, 0, 0, 1});
  return bytes;
}

// The announcement of a participant, with all that a receiver requires.
inline Announcement valid_participant(const Prefix& sender) {
  constexpr std::uint32_t kDiscard = 9;
  Announcement all;
  all.with(0x15, {2, 3, 0, 0}).with(0x16, {1, 15, 0, 0}).with(0x50, guid(sender, {0, 0, 1, 0xc1}));
  all.with(0x58, words({0xc3f})).with(0x02, words({5, 0}));
  return all.with(0x31, address_on_loopback(kDiscard)).with(0x32, address_on_loopback(kDiscard));
}
inline Announcement valid_endpoint(const Prefix& sender, const Entity& entity, const std::string& topic,
                                   const std::string& type) {
  Announcement all;
  all.with(0x50, guid(sender, {0, 0, 1, 0xc1})).with(0x5a, guid(sender, entity));
  all.with(0x05, text(topic)).with(0x07, text(type)).with(0x1d, words({0}));
  return all.with(0x1a, words({2, 0, 0x80000000}));
}

enum class Treatment { refused, blanked, passed };  // of the datagram that has the fault

struct PublishedFault {
  const char* name;
  Treatment treatment;
  std::vector<Octets> datagrams;  // the last one has the fault
};

inline constexpr std::uint32_t kHuge = 0xffffffff;

// Faults in the sizes and numbers of submessages, from the kUserWriter of a participant.
inline std::vector<PublishedFault> faults_of_submessages(const Prefix& sender) {
  using enum Treatment;
  const auto fault = [](const char* name, Treatment treatment, const RtpsPacket& packet) {
    return PublishedFault{name, treatment, {packet.bytes()}};
  };
  const auto range = [&](std::uint8_t kind, std::int64_t first, std::int64_t second, std::uint32_t word) {
    return RtpsPacket(sender).range(kind, kUserWriter, first, second, word);
  };
  const auto data = [&](std::uint32_t offset, const Octets& payload) {
    return RtpsPacket(sender).submessage(0x15, 0x06, RtpsPacket::data_body(kUserWriter, 1, offset, payload));
  };
  const auto fragment = [&](std::uint32_t count, std::uint32_t size, std::uint32_t whole,
                            std::size_t payload) {
    return RtpsPacket(sender).fragment(kUserWriter, 1, 1, count, size, whole, Octets(payload));
  };
  constexpr std::int64_t kFar = std::int64_t{1} << 40;
  return {
      fault("CVE-2023-39534 GAP that ends before it begins", passed, range(8, 5, 3, 0)),
      fault("CVE-2023-39949 heartbeat below its first sample", passed, range(7, 9, 2, 1)),
      fault("CVE-2023-42459 DATA with a payload behind its end", refused, data(0xffff, {0, 1, 0, 0})),
      fault("CVE-2023-50716 fragment beyond its message", refused, fragment(1, 0xffff, 0xffff, 16)),
      fault("CVE-2024-28231 DATA shorter than its inline QoS", refused, data(16, {0x70, 0, 0xff, 0xff})),
      fault("CVE-2025-62799 last fragment without room for the list", refused, fragment(1, 1000, 2001, 1000)),
      fault("CVE-2025-62799 fragments of one byte", refused, fragment(8, 1, 4096, 8)),
      fault("CVE-2025-63829 time without end", passed,
            RtpsPacket(sender).submessage(0x09, 0, words({kHuge, kHuge}))),
      fault("CVE-2025-64438 GAP of 2^40 numbers", refused, range(8, 2, kFar, 0)),
      fault("CVE-2025-64438 GAP far from the first sample", refused, range(8, 9'000'000, 9'050'000, 0)),
      fault("CVE-2025-65016 heartbeat that leaps", refused, range(7, 2 * kFar, 2 * kFar, 2)),
      fault("CVE-2025-65865 fragment shorter than its inline QoS", refused,
            RtpsPacket(sender).fragment(kUserWriter, 1, 1, 1, 64, 256, {0x70, 0, 0xfc, 0xff}, 0x06)),
      fault("CVE-2026-22590 fragment with fewer bytes than declared", refused, fragment(4, 1000, 8000, 1000)),
  };
}

inline Octets announced_participant(const Prefix& sender, std::uint16_t id, const Octets& value) {
  return RtpsPacket(sender).data(kParticipants, 2, valid_participant(sender).with(id, value).end()).bytes();
}
inline Octets announced_endpoint(const Prefix& sender, const Entity& announcer, std::uint16_t id,
                                 const Octets& value) {
  const Entity entity{0, 0, 0x77, static_cast<std::uint8_t>(announcer == kWriters ? 0x03 : 0x04)};
  Announcement all = valid_endpoint(sender, entity, "rt/joint_states", "sensor_msgs::msg::dds_::JointState_");
  return RtpsPacket(sender).data(announcer, 2, all.with(id, value).end()).bytes();
}

inline Octets token(const Octets& rest) {
  Octets all = text("DDS:Auth:PKI-DH:1.0");
  put(all, rest);
  return all;
}

// Faults in the tokens and messages of DDS Security, which a receiver without it parses as well. Sums of
// most of the lengths with the position overflow 32 bits.
inline std::vector<PublishedFault> faults_of_security(const Prefix& sender) {
  using enum Treatment;
  std::vector<PublishedFault> all;
  for (const std::uint16_t id :
       {std::uint16_t{0x1001}, std::uint16_t{0x1002}}) {  // of identity, of permissions
    const auto add = [&](const char* name, const Octets& value) {
      all.push_back({name, blanked, {announced_participant(sender, id, value)}});
    };
    add("CVE-2024-30258 token with 2^28 properties", token(words({0x10000000, 1, 0})));
    add("CVE-2024-30259 token with 2^30 binary properties", token(words({0, 0x40000000, 1, 0})));
    add("CVE-2025-62599 token with a property of 2^32 bytes", token(words({1, kHuge - 3})));
    add("CVE-2025-62600 token with a binary property of 2^32 bytes", token(words({0, 1, 1, 0, kHuge})));
    add("CVE-2025-62601 token with a text of 2^32 bytes", words({kHuge - 7, 0}));
    add("CVE-2025-62602 token with a text behind its end", words({64, 0x41414141}));
    add("CVE-2025-64098 token with octets of 2^32 bytes", token(words({0, 1, 2, 0x41, kHuge, 0})));
  }
  Octets message{0, 1, 0, 0};
  message.resize(4 + 24 + 32);
  put(message, text("dds.sec.auth"));
  put(message, words({0x10000000}));
  all.push_back({"CVE-2025-62603 message with 2^28 holders",
                 passed,
                 {RtpsPacket(sender).data(kSecurity, 1, message).bytes()}});
  return all;
}

// Faults in the other parameters of announcements.
inline std::vector<PublishedFault> faults_of_parameters(const Prefix& sender) {
  using enum Treatment;
  Octets filter;
  for (const char* const part : {"filter", "rt/joint_states", "DDSSQL"}) put(filter, text(part));
  put(filter, text(std::string(8000, '(')));
  put(filter, words({0}));
  const auto participant = [&](std::uint16_t id, const Octets& value) {
    return std::vector<Octets>{announced_participant(sender, id, value)};
  };
  const auto endpoint = [&](const Entity& announcer, std::uint16_t id, const Octets& value) {
    return std::vector<Octets>{announced_endpoint(sender, announcer, id, value)};
  };
  return {
      {"CVE-2023-39946 property longer than its list", blanked,
       participant(0x59, words({1, 0x1000, 0x41414141}))},
      {"CVE-2023-39947 properties without end", blanked, participant(0x59, words({kHuge, 1, 0, 1, 0}))},
      {"CVE-2025-63829 lease of zero", refused, participant(0x02, words({0, 0}))},
      {"CVE-2026-22591 filter of 8000 parentheses", blanked, endpoint(kReaders, 0x35, filter)},
      {"CVE-2026-49861 representations without end", refused,
       endpoint(kReaders, 0x73, words({0x7fffffff, 0}))},
      {"CVE-2026-49861 data sharing domains without end", blanked,
       endpoint(kReaders, 0x8006, words({0x1fffffff, 0, 0}))},
      {"CVE-2026-49863 type information longer than its parameter", blanked,
       endpoint(kWriters, 0x75, words({0x7fffffff, 0x60000000, 0x7fffffff}))},
      {"CVE-2026-53590 properties that are not there", blanked,
       endpoint(kWriters, 0x59, words({0x20000000}))},
      {"CVE-2026-55063 partition without its zero byte", refused,
       endpoint(kWriters, 0x29, words({1, 8, 0x41414141, 0x41414141}))},
  };
}

// A fault in an announcement that comes in fragments, which only the assembly of the receiver shows.
inline PublishedFault fault_in_fragments(const Prefix& sender) {
  constexpr std::uint32_t kSize = 64;
  const Octets whole = valid_participant(sender).with(0x1001, token(words({0x10000000, 1, 0}))).end();
  PublishedFault fault{"CVE-2024-30258 in fragments", Treatment::blanked, {}};
  for (std::size_t begin = 0; begin < whole.size(); begin += kSize) {
    const std::size_t end = std::min(whole.size(), begin + kSize);
    RtpsPacket packet(sender);
    packet.fragment(kParticipants, 3, static_cast<std::uint32_t>(begin / kSize + 1), 1, kSize,
                    static_cast<std::uint32_t>(whole.size()), {&whole[begin], whole.data() + end});
    fault.datagrams.push_back(packet.bytes());
  }
  return fault;
}

// All of them, by a participant that has announced itself and its kUserWriter.
inline std::vector<PublishedFault> published_faults(const Prefix& sender) {
  std::vector<PublishedFault> all{fault_in_fragments(sender)};
  for (const auto& faults : {faults_of_submessages, faults_of_security, faults_of_parameters}) {
    const std::vector<PublishedFault> more = faults(sender);
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

}  // namespace doppel::ros2_testing
