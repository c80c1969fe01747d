#pragma once
// The DDS implementation that carries ROS 2's network, and the faults that are published of its version.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel::ros2 {

// A published fault in the reading of datagrams without DDS Security.
struct PublishedFault {
  std::string_view name;  // "CVE-2024-30258"
  std::string_view
      fixed;  // the first version of the main branch without it: "2.14.1"; "": none in August 2026
};

// "2.9.1": the version of Fast DDS that this build uses. Throws NetworkError where its module is missing.
DOPPEL_API std::string fast_dds_version();

// The faults that a version has by its number. Distributions repair some without another number.
DOPPEL_API std::vector<PublishedFault> faults_of_fast_dds(std::string_view version);

// "Fast DDS 2.9.1, for which 26 faults are published; doppel keeps their datagrams out".
DOPPEL_API std::string describe_middleware(std::string_view version);

}  // namespace doppel::ros2
