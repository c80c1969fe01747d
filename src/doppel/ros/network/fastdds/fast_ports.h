#pragma once
// RTPS' well-known ports (DDSI-RTPS 2.5, 9.6.2.3).

#include <cstdint>
#include <string>

namespace doppel::ros2::fast {

struct Ports {
  std::uint16_t multicast = 0, discovery = 0, data = 0;
};

// Those of the first free participant index of the domain at `address` ("0.0.0.0": any). Throws NetworkError.
Ports free_ports(std::uint32_t domain, const std::string& address);

}  // namespace doppel::ros2::fast
