#include "doppel/ros/network/middleware.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "doppel/base/core/plugin_module.h"
#include "doppel/ros/network/detail/participant.h"

namespace doppel::ros2 {
namespace {

// From the advisories and the history of eProsima/Fast-DDS, August 2026; docs/security.md says what each
// is, and ros/network/test/published_faults.h has a datagram for each.
constexpr PublishedFault kFaults[] = {
    {"CVE-2023-39534", "2.10.0"}, {"CVE-2023-39946", "2.11.1"}, {"CVE-2023-39947", "2.11.1"},
    {"CVE-2023-39949", "2.10.0"}, {"CVE-2023-42459", "2.12.0"}, {"CVE-2023-50716", "2.13.0"},
    {"CVE-2024-28231", "2.14.0"}, {"CVE-2024-30258", "2.14.1"}, {"CVE-2024-30259", "2.14.1"},
    {"CVE-2025-62599", "3.4.1"},  {"CVE-2025-62600", "3.4.1"},  {"CVE-2025-62601", "3.4.1"},
    {"CVE-2025-62602", "3.4.1"},  {"CVE-2025-62603", "3.4.1"},  {"CVE-2025-62799", "3.4.1"},
    {"CVE-2025-63829", "3.6.2"},  {"CVE-2025-64098", "3.4.1"},  {"CVE-2025-64438", "3.4.1"},
    {"CVE-2025-65016", "3.4.2"},  {"CVE-2025-65865", "3.6.2"},  {"CVE-2026-22590", "3.5.0"},
    {"CVE-2026-22591", "3.6.0"},  {"CVE-2026-49861", ""},       {"CVE-2026-49863", ""},
    {"CVE-2026-53590", ""},       {"CVE-2026-55063", ""},
};

std::array<int, 3> parts_of(std::string_view version) {
  std::array<int, 3> parts{};
  for (int& part : parts) {
    const auto [end, error] = std::from_chars(version.data(), version.data() + version.size(), part);
    if (error != std::errc{}) break;
    version.remove_prefix(std::min(version.size(), static_cast<std::size_t>(end - version.data()) + 1));
  }
  return parts;
}

}  // namespace

std::string fast_dds_version() {
  try {
    static const auto version =
        reinterpret_cast<detail::VersionOfModule>(plugin_symbol("doppel_fastdds", detail::kVersionOfModule));
    return version();
  } catch (const MissingModule& error) {
    throw NetworkError(std::string("ROS 2 is not available: ") + error.what());
  }
}

std::vector<PublishedFault> faults_of_fast_dds(std::string_view version) {
  std::vector<PublishedFault> faults;
  std::ranges::copy_if(kFaults, std::back_inserter(faults), [&](const PublishedFault& fault) {
    return fault.fixed.empty() || parts_of(version) < parts_of(fault.fixed);
  });
  return faults;
}

std::string describe_middleware(std::string_view version) {
  return fmt::format("Fast DDS {}, for which {} faults are published; doppel keeps their datagrams out",
                     version, faults_of_fast_dds(version).size());
}

}  // namespace doppel::ros2
