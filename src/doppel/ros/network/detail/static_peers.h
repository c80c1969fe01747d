#pragma once
// The hosts that ROS_STATIC_PEERS names, as addresses.

#include <functional>
#include <string>
#include <vector>

namespace doppel::ros2 {

// The IPv4 address of a host ("" where there is none); may take as long as the resolver's patience.
using Lookup = std::function<std::string(const std::string& name)>;
std::string look_up(const std::string& name);

// In the order of `peers`. During the lookup `is_cancelled`, which may be empty, is called about every 20 ms
// or so; a lookup that is given up ends by itself, and `lookup` may outlive the call. Throws NetworkError: a
// name is unknown, or it was cancelled.
std::vector<std::string> addresses_of(const std::vector<std::string>& peers,
                                      const std::function<bool()>& is_cancelled, Lookup lookup = look_up);

}  // namespace doppel::ros2
