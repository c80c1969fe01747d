#include "doppel/ros/network/detail/rtps.h"

namespace doppel::ros2::rtps {
namespace {

constexpr std::size_t kOffsetAt = 2, kOffsetFrom = 4;  // in the bodies of DATA and DATA_FRAG

// The least size of the parameters of inline QoS that Fast DDS reads; 0 for the others, which it skips.
std::size_t least_size(std::uint16_t id) {
  constexpr std::uint16_t kOriginalWriter = 0x61, kKeyHash = 0x70, kStatus = 0x71, kRelatedSample = 0x83,
                          kRelatedSampleOfFastDds = 0x800f;
  switch (id) {
    case kKeyHash:
      return 16;
    case kStatus:
      return 4;
    case kOriginalWriter:
    case kRelatedSample:
    case kRelatedSampleOfFastDds:
      return 24;
    default:
      return 0;
  }
}

// The bytes that follow a list of inline QoS; nothing where the list does not end.
std::optional<Bytes> behind_inline_qos(Bytes list, bool little) {
  while (const auto parameter = take_parameter(list, little)) {
    if (parameter->id == kSentinel) return list;
    if (parameter->value.size() < least_size(parameter->id)) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Submessage> take_submessage(Bytes& submessages) {
  if (submessages.size() < kSubmessageHeaderSize) return std::nullopt;
  Submessage first{submessages[0], submessages[1], {}, {}};
  const std::size_t left = submessages.size() - kSubmessageHeaderSize;
  std::size_t size = number(&submessages[2], 2, first.is_little());
  if (size == 0 && first.kind != kPad && first.kind != kInfoTimestamp) size = left;  // it is the last one
  if (size > left) return std::nullopt;
  first.whole = submessages.first(kSubmessageHeaderSize + size);
  first.body = first.whole.subspan(kSubmessageHeaderSize);
  submessages = submessages.subspan(first.whole.size());
  return first;
}

std::optional<Parameter> take_parameter(Bytes& list, bool little) {
  constexpr std::size_t kHead = 4;
  if (list.size() < kHead) return std::nullopt;
  const auto id = static_cast<std::uint16_t>(number(list.data(), 2, little));
  const std::size_t size = id == kSentinel ? 0 : (number(&list[2], 2, little) + 3) & ~std::size_t{3};
  if (size > list.size() - kHead) return std::nullopt;
  const Parameter parameter{id, list.subspan(kHead, size)};
  list = list.subspan(kHead + size);
  return parameter;
}

std::optional<Bytes> payload(std::uint8_t kind, std::uint8_t flags, Bytes body) {
  const bool little = (flags & kLittleEndian) != 0;
  const std::size_t fixed = kind == kData ? kMinDataSize : kMinFragmentSize;
  if (body.size() < fixed) return std::nullopt;
  const std::size_t begin = kOffsetFrom + number(&body[kOffsetAt], 2, little);
  if (begin < fixed || begin > body.size()) return std::nullopt;
  std::optional result = body.subspan(begin);
  if ((flags & kHasInlineQos) != 0) result = behind_inline_qos(*result, little);
  return result;
}

}  // namespace doppel::ros2::rtps
