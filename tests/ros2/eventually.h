#pragma once
// Waiting for a condition, never for a time: the limit applies only to what will not happen at all.

#include <chrono>
#include <functional>
#include <thread>

namespace doppel::ros2_testing {

constexpr std::chrono::seconds kTimeout{60};

// Whether the condition becomes true; evaluated every two milliseconds, at least once.
inline bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds limit = kTimeout) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace doppel::ros2_testing
