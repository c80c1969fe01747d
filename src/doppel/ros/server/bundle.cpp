#include "doppel/ros/server/detail/bundle.h"

#include <algorithm>
#include <charconv>
#include <vector>

#include "doppel/ros/server/detail/header_text.h"

namespace doppel {
namespace {

constexpr std::string_view kPeriod = "bundle=";
constexpr int kMaxPeriod = 100;  // ms
constexpr std::size_t kLengthBytes = 4;

void append_length(foxglove::FrameBytes& out, std::size_t length) {
  for (std::size_t i = 0; i < kLengthBytes; ++i) out.push_back(static_cast<std::byte>(length >> (8 * i)));
}

}  // namespace

std::chrono::milliseconds bundle_period(std::string_view target) {
  const std::size_t question = target.find('?');
  if (question == std::string_view::npos) return {};
  int period = 0;
  any_entry(target.substr(question + 1), '&', [&period](std::string_view entry) {
    if (!entry.starts_with(kPeriod)) return false;
    const std::string_view number = entry.substr(kPeriod.size());
    const auto [end, problem] = std::from_chars(number.data(), number.data() + number.size(), period);
    if (problem != std::errc{} || end != number.data() + number.size()) period = 0;
    return true;
  });
  return std::chrono::milliseconds(std::clamp(period, 0, kMaxPeriod));
}

std::optional<OutgoingFrame> pop_bundle(SendQueue& queue) {
  auto first = queue.pop();
  const auto fits = [](const OutgoingFrame& frame, std::size_t before) {
    return frame.kind == OutgoingFrame::Kind::message && !frame.text &&
           before + kLengthBytes + frame.size() <= kMaxBundleBytes;
  };
  const OutgoingFrame* next = queue.front();
  if (!first || next == nullptr || !fits(*first, 1) || !fits(*next, 1 + kLengthBytes + first->size())) {
    return first;
  }
  foxglove::FrameBytes bytes{kBundleOpcode};
  const auto append = [&bytes](const OutgoingFrame& frame) {
    append_length(bytes, frame.size());
    bytes.insert(bytes.end(), frame.head.begin(),
                 frame.head.begin() + static_cast<std::ptrdiff_t>(frame.head_size));
    bytes.insert(bytes.end(), frame.body.begin(), frame.body.end());
  };
  append(*first);
  for (; next != nullptr && fits(*next, bytes.size()); next = queue.front()) {
    append(*next);
    queue.pop();
  }
  OutgoingFrame bundle = make_frame(std::move(bytes));
  bundle.kind = OutgoingFrame::Kind::message;
  return bundle;
}

}  // namespace doppel
