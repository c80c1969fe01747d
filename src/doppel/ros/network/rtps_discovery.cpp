#include "doppel/ros/network/detail/rtps_discovery.h"

#include <algorithm>

#include "doppel/ros/network/detail/rtps.h"

namespace doppel::ros2 {
namespace {

using rtps::Bytes;
using Entity = std::array<std::uint8_t, 4>;

// The writers of announcements: of participants, of writers and of readers.
constexpr Entity kParticipants{0, 1, 0, 0xc2}, kWriters{0, 0, 3, 0xc2}, kReaders{0, 0, 4, 0xc2};

// A submessage with a sample, which RtpsGuard has found to be long enough.
bool is_from(const rtps::Submessage& submessage, const Entity& writer) {
  return std::ranges::equal(submessage.body.subspan(rtps::kDataWriterAt, 4), writer);
}

bool is_announcement(const rtps::Submessage& submessage) {
  return submessage.has_sample() && (is_from(submessage, kParticipants) || is_from(submessage, kWriters) ||
                                     is_from(submessage, kReaders));
}

constexpr std::size_t kEncapsulation = 4;
constexpr std::uint8_t kBigList = 2, kLittleList = 3;  // parameter lists, by byte order

enum class Content {
  fixed,
  text,             // a length and as many bytes, the last of them zero
  octets,           // a length and as many bytes
  texts,            // a number of texts
  representations,  // a number of two bytes each
  lease,            // a duration, which must not be negative or zero
};

struct Requirement {
  std::uint16_t id;
  Content content = Content::fixed;
  std::size_t least = 4;  // bytes
};

// The parameters that discovery by ROS 2 needs: DDSI-RTPS 2.5, 9.6.3 and 9.6.4, and three of eProsima.
// The key (0x70) is not among them: Fast DDS would take it for the identity of the endpoint.
constexpr Requirement kNeeded[] = {
    {0x0002, Content::lease, 8},         // lease of a participant
    {0x0004, Content::fixed, 8},         // time-based filter
    {0x0005, Content::text},             // topic
    {0x0006},                            // ownership strength
    {0x0007, Content::text},             // type
    {0x000f},                            // domain
    {0x0015},                            // protocol version
    {0x0016},                            // vendor
    {0x001a, Content::fixed, 12},        // reliability
    {0x001b, Content::fixed, 12},        // liveliness
    {0x001d},                            // durability
    {0x001f},                            // ownership
    {0x0021, Content::fixed, 8},         // presentation
    {0x0023, Content::fixed, 8},         // deadline
    {0x0025},                            // order at the destination
    {0x0027, Content::fixed, 8},         // latency budget
    {0x0029, Content::texts},            // partitions
    {0x002b, Content::fixed, 8},         // lifespan
    {0x002c, Content::octets},           // user data: ROS 2's enclave and type hash
    {0x002d, Content::octets},           // group data
    {0x002e, Content::octets},           // topic data
    {0x002f, Content::fixed, 24},        // unicast address
    {0x0030, Content::fixed, 24},        // multicast address
    {0x0031, Content::fixed, 24},        // the same two of a participant's data
    {0x0048, Content::fixed, 24},        //
    {0x0032, Content::fixed, 24},        // and of its discovery
    {0x0033, Content::fixed, 24},        //
    {0x0034},                            // count of manual liveliness
    {0x0043},                            // expects inline QoS
    {0x0050, Content::fixed, 16},        // participant
    {0x0052, Content::fixed, 16},        // group
    {0x0053},                            // entity of the group
    {0x0058},                            // built-in endpoints
    {0x005a, Content::fixed, 16},        // endpoint
    {0x0060},                            // largest size of the type
    {0x0062, Content::text},             // name
    {0x0071},                            // status
    {0x0073, Content::representations},  // data representation
    {0x0077},                            // QoS of the built-in endpoints
    {0x8000},                            // version of the product
    {0x8005},                            // no positive acknowledgements
    {0x8007},                            // kinds of its network
};

// A length and as many bytes at the beginning of `value`, which then begins behind them and their padding.
std::optional<Bytes> take_counted(Bytes& value, bool little) {
  constexpr std::size_t kCount = 4;
  if (value.size() < kCount) return std::nullopt;
  const std::size_t size = rtps::number(value.data(), kCount, little);
  if (size > value.size() - kCount) return std::nullopt;
  const Bytes content = value.subspan(kCount, size);
  value = value.subspan(std::min(value.size(), kCount + ((size + 3) & ~std::size_t{3})));
  return content;
}

bool take_text(Bytes& value, bool little) {
  const auto text = take_counted(value, little);
  return text && (text->empty() || text->back() == 0);
}

bool take_texts(Bytes value, bool little) {
  std::uint32_t count = rtps::number(value.data(), 4, little);
  value = value.subspan(4);
  while (count > 0 && take_text(value, little))
    --count;  // ends with the value: each takes four bytes or more
  return count == 0;
}

bool is_well_formed(const Requirement& needed, Bytes value, bool little) {
  if (value.size() < needed.least) return false;
  switch (needed.content) {
    case Content::fixed:
      return true;
    case Content::text:
      return take_text(value, little);
    case Content::octets:
      return take_counted(value, little).has_value();
    case Content::texts:
      return take_texts(value, little);
    case Content::representations:
      return rtps::number(value.data(), 4, little) <= (value.size() - 4) / 2;
    case Content::lease: {
      const std::uint32_t seconds = rtps::number(value.data(), 4, little);
      constexpr std::uint32_t kNegative = 0x80000000;
      return seconds < kNegative && (seconds != 0 || rtps::number(&value[4], 4, little) != 0);
    }
  }
  return false;
}

// The policies of an endpoint that never change (DDS 1.4, 2.2.3) are its topic, type, durability,
// reliability, liveliness, ownership and order. Of those with further values the kind comes first.
constexpr std::uint16_t kImmutable[] = {0x0005, 0x0007, 0x001a, 0x001b, 0x001d, 0x001f, 0x0025};
constexpr std::uint16_t kTopicId = 0x0005, kTypeId = 0x0007, kEndpointId = 0x005a;

struct AnnouncedEndpoint {
  Gid gid;
  std::uint64_t policies = 0;  // FNV-1a of those that never change
};

// The endpoint of an announcement that reduce() has accepted; nothing if it has no identity.
std::optional<AnnouncedEndpoint> endpoint_of(Bytes announcement) {
  constexpr std::uint64_t kBasis = 0xcbf29ce484222325, kPrime = 0x100000001b3;
  const bool little = announcement[1] == kLittleList;
  AnnouncedEndpoint endpoint{{}, kBasis};
  bool has_identity = false;
  const auto mix = [&](std::uint8_t byte) { endpoint.policies = (endpoint.policies ^ byte) * kPrime; };
  Bytes list = announcement.subspan(kEncapsulation);
  for (auto parameter = rtps::take_parameter(list, little); parameter && parameter->id != rtps::kSentinel;
       parameter = rtps::take_parameter(list, little)) {
    if (parameter->id == kEndpointId) {
      std::copy_n(parameter->value.begin(), endpoint.gid.bytes.size(), endpoint.gid.bytes.begin());
      has_identity = true;
    }
    if (std::ranges::find(kImmutable, parameter->id) == std::end(kImmutable)) continue;
    const bool is_name = parameter->id == kTopicId || parameter->id == kTypeId;
    mix(static_cast<std::uint8_t>(parameter->id));
    std::ranges::for_each(is_name ? parameter->value : parameter->value.first(4), mix);
  }
  return has_identity ? std::optional(endpoint) : std::nullopt;
}

// The announcement with padding for each parameter that is not in kNeeded; false if one that is cannot be
// read, or the list does not end.
bool reduce(std::span<std::uint8_t> announcement) {
  if (announcement.size() < kEncapsulation || announcement[0] != 0) return false;
  if (announcement[1] != kBigList && announcement[1] != kLittleList) return false;
  const bool little = announcement[1] == kLittleList;
  for (Bytes list = announcement.subspan(kEncapsulation);;) {
    std::uint8_t* const head = announcement.data() + (announcement.size() - list.size());
    const auto parameter = rtps::take_parameter(list, little);
    if (!parameter) return false;
    if (parameter->id == rtps::kSentinel) return true;
    const Requirement* const needed = std::ranges::find(kNeeded, parameter->id, &Requirement::id);
    if (needed == std::end(kNeeded)) {
      head[0] = head[1] = 0;  // padding
    } else if (!is_well_formed(*needed, parameter->value, little)) {
      return false;
    }
  }
}

std::array<std::uint8_t, Gid::kPrefixSize> prefix_of(const Gid& gid) {
  std::array<std::uint8_t, Gid::kPrefixSize> prefix{};
  std::ranges::copy(gid.prefix(), prefix.begin());
  return prefix;
}

}  // namespace

bool has_announcement(Bytes datagram) {
  Bytes submessages = datagram.subspan(rtps::kHeaderSize);
  while (const auto submessage = rtps::take_submessage(submessages))
    if (is_announcement(*submessage)) return true;
  return false;
}

void AnnouncedEndpoints::join(const Gid& participant) {
  const std::lock_guard lock(mutex_);
  participants_[prefix_of(participant)].is_present = true;
}

void AnnouncedEndpoints::leave(const Gid& participant) {
  const std::lock_guard lock(mutex_);
  const auto place = participants_.find(prefix_of(participant));
  if (place == participants_.end()) return;
  place->second.is_present = false;
  place->second.departure = ++departures_;
  if (place->second.endpoints.empty()) participants_.erase(place);
}

// Forgets the participants that left first.
bool AnnouncedEndpoints::has_room() {
  while (endpoints_ >= kMaxAnnouncedEndpoints) {
    const auto first = std::ranges::min_element(participants_, {}, [](const auto& entry) {
      return std::pair(entry.second.is_present, entry.second.departure);
    });
    if (first->second.is_present) return false;
    endpoints_ -= first->second.endpoints.size();
    participants_.erase(first);
  }
  return true;
}

bool AnnouncedEndpoints::admits(const Gid& endpoint, std::uint64_t policies) {
  const std::lock_guard lock(mutex_);
  const auto participant = participants_.find(prefix_of(endpoint));
  if (participant == participants_.end() || !participant->second.is_present) return false;
  auto& endpoints = participant->second.endpoints;
  const auto earlier = endpoints.find(endpoint);
  if (earlier != endpoints.end()) return earlier->second == policies;
  if (!has_room()) return false;
  ++endpoints_;
  return endpoints.emplace(endpoint, policies).second;
}

// The announcement that is in a submessage as a whole, or the key of one that ends.
bool RtpsDiscovery::append_data(const rtps::Submessage& submessage, Bytes payload) {
  const std::size_t begin = result_.size() + submessage.whole.size() - payload.size();
  result_.insert(result_.end(), submessage.whole.begin(), submessage.whole.end());
  if ((submessage.flags & (rtps::kHasData | rtps::kHasKey)) == 0) return true;
  const auto announcement = std::span(result_).subspan(begin);
  if (!reduce(announcement)) return false;
  return (submessage.flags & rtps::kHasData) == 0 || admits_endpoint(submessage, announcement);
}

// Fast DDS 2.9 stores the new policies of an endpoint even if they may not change, and an assertion ends
// the process when a best-effort reader has become a reliable one (ReaderProxy::from_unsent_to_status).
bool RtpsDiscovery::admits_endpoint(const rtps::Submessage& submessage, Bytes announcement) {
  if (is_from(submessage, kParticipants)) return true;
  const auto endpoint = endpoint_of(announcement);
  return endpoint && endpoints_->admits(endpoint->gid, endpoint->policies);
}

RtpsDiscovery::Open* RtpsDiscovery::open_announcement(const Sample& sample, std::uint32_t fragment_size,
                                                      std::uint32_t whole) {
  const auto [place, is_new] = open_.try_emplace(sample);
  Open& open = place->second;
  if (is_new) {
    open.fragment_size = fragment_size;
    open.bytes.resize(whole);
    open.received.resize((whole + fragment_size - 1) / fragment_size);
  }
  open.age = ++age_;
  if (open_.size() > kMaxOpenAnnouncements)
    open_.erase(std::ranges::min_element(open_, {}, [](const auto& entry) { return entry.second.age; }));
  return open.fragment_size == fragment_size && open.bytes.size() == whole ? &open : nullptr;
}

// Fast DDS would parse what it assembles itself unseen, so that it receives the whole as one DATA in place
// of the fragment that completes it.
bool RtpsDiscovery::append_fragment(const rtps::Submessage& submessage, Bytes payload, Bytes prefix) {
  const bool little = submessage.is_little();
  const Bytes body = submessage.body;
  const std::uint32_t first = rtps::number(&body[rtps::kFirstFragmentAt], 4, little) - 1;
  const std::uint32_t count = rtps::number(&body[rtps::kFragmentCountAt], 2, little);
  const std::uint32_t fragment_size = rtps::number(&body[rtps::kFragmentSizeAt], 2, little);
  const std::uint32_t whole = rtps::number(&body[rtps::kSampleSizeAt], 4, little);
  if (whole > kMaxAnnouncement) return false;
  Sample sample{};
  std::ranges::copy(prefix, sample.begin());
  std::ranges::copy(body.subspan(rtps::kDataWriterAt, 12), sample.begin() + rtps::kPrefixSize);
  Open* const open = open_announcement(sample, fragment_size, whole);
  if (open == nullptr) return false;
  const std::size_t begin = std::size_t{first} * fragment_size;
  std::ranges::copy(payload.first(std::min<std::size_t>(payload.size(), whole - begin)),
                    open->bytes.begin() + begin);
  std::fill_n(open->received.begin() + first, std::min<std::size_t>(count, open->received.size() - first),
              true);
  if (std::ranges::find(open->received, false) != open->received.end()) return true;

  const std::vector<std::uint8_t> announcement = std::move(open->bytes);
  open_.erase(sample);
  constexpr std::uint8_t kOffset = 16;  // from its own field to the payload: there is no inline QoS
  const std::size_t size = (rtps::kMinDataSize + announcement.size() + 3) & ~std::size_t{3};
  const auto low = static_cast<std::uint8_t>(size), high = static_cast<std::uint8_t>(size >> 8);
  const auto flags = static_cast<std::uint8_t>((little ? rtps::kLittleEndian : 0) | rtps::kHasData);
  result_.insert(result_.end(), {rtps::kData, flags, little ? low : high, little ? high : low, 0, 0,
                                 little ? kOffset : std::uint8_t{0}, little ? std::uint8_t{0} : kOffset});
  const Bytes entities = body.subspan(rtps::kDataReaderAt, rtps::kMinDataSize - rtps::kDataReaderAt);
  result_.insert(result_.end(), entities.begin(), entities.end());
  const std::size_t place = result_.size();
  result_.insert(result_.end(), announcement.begin(), announcement.end());
  result_.resize(place + size - rtps::kMinDataSize);
  const auto reassembled = std::span(result_).subspan(place);
  return reduce(reassembled) && admits_endpoint(submessage, reassembled);
}

std::optional<std::span<const std::uint8_t>> RtpsDiscovery::reduced(std::span<const std::uint8_t> datagram) {
  Bytes submessages = datagram.subspan(rtps::kHeaderSize);
  result_.assign(datagram.begin(), datagram.begin() + rtps::kHeaderSize);
  Bytes prefix = datagram.subspan(rtps::kPrefixAt, rtps::kPrefixSize);
  while (const auto submessage = rtps::take_submessage(submessages)) {
    if (submessage->kind == rtps::kInfoSource)
      prefix = submessage->body.subspan(rtps::kPrefixAt, rtps::kPrefixSize);
    if (!is_announcement(*submessage)) {
      result_.insert(result_.end(), submessage->whole.begin(), submessage->whole.end());
      continue;
    }
    const auto payload = rtps::payload(submessage->kind, submessage->flags, submessage->body);
    if (!payload) return std::nullopt;
    const bool is_good = submessage->kind == rtps::kData ? append_data(*submessage, *payload)
                                                         : append_fragment(*submessage, *payload, prefix);
    if (!is_good) return std::nullopt;
  }
  return result_;
}

}  // namespace doppel::ros2
