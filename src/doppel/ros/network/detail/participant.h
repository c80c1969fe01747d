#pragma once
// The interface between participant.cpp and the plugin module with Fast DDS (fastdds/).

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>

#include "doppel/ros/network/participant.h"

namespace doppel::ros2::detail {

constexpr const char* kMakeParticipant = "doppel_make_fast_participant";

// The caller owns the result. Static peers are addresses here. Throws NetworkError.
using MakeParticipant = Participant* (*)(const ParticipantOptions& options,
                                         std::function<void()> on_activity);

constexpr const char* kVersionOfModule = "doppel_fast_dds_version";
using VersionOfModule = const char* (*)();

// ROS 2's user data is "key=value;key=value;"; "" if `key` is missing. Peers may send anything.
inline std::string user_data_value(std::string_view data, std::string_view key) {
  while (!data.empty()) {
    const std::size_t end = data.find(';');
    if (end == std::string_view::npos) return "";
    const std::string_view entry = data.substr(0, end);
    data.remove_prefix(end + 1);
    if (entry.size() > key.size() && entry.starts_with(key) && entry[key.size()] == '=')
      return std::string(entry.substr(key.size() + 1));
  }
  return "";
}

// A type hash is the only part of the user data that is printed, so only a well-formed one is accepted.
inline std::string type_hash_of(std::string_view user_data) {
  constexpr std::string_view kVersion = "RIHS01_";
  std::string hash = user_data_value(user_data, "typehash");
  const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  const bool fits = hash.size() == kVersion.size() + 64 && hash.starts_with(kVersion) &&
                    std::all_of(hash.begin() + kVersion.size(), hash.end(), is_hex);
  return fits ? hash : "";
}

}  // namespace doppel::ros2::detail
