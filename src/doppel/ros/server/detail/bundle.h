#pragma once
// Several messages in one WebSocket frame, for the page: a browser handles each frame as an event of its own,
// and an arm at rest publishes some 400 messages per second. A client asks for it in its address,
// "/?bundle=16": messages then wait for up to that many milliseconds and are sent together. Other clients,
// and other servers, know nothing of it.
//
// A bundle is a binary frame: the byte kBundleOpcode, which the Foxglove protocol does not use, then each
// message as a 32-bit little-endian length and the frame that it has without a bundle.

#include <chrono>
#include <optional>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/server/send_queue.h"

namespace doppel {

inline constexpr std::byte kBundleOpcode{0x80};
// Bytes; a queue with more is sent at once, and a message with more is sent alone.
inline constexpr std::size_t kMaxBundleBytes = std::size_t{64} << 10;

// The time in the address of a request; zero: the client does not ask for bundles.
DOPPEL_API std::chrono::milliseconds bundle_period(std::string_view target);

// The next frame of the queue, or all messages at its front that fit into one bundle.
DOPPEL_API std::optional<OutgoingFrame> pop_bundle(SendQueue& queue);

}  // namespace doppel
