#pragma once
// Programs of the user that a launch file starts, found on this machine.

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/scenario/launch/launch_plan.h"

namespace doppel {

struct OwnProgram {
  LaunchedProgram start;
  std::string problem, fix;  // it is not on this machine
};

// A node: its executable in install/, devel/ or the package's source, with its ROS arguments. `folder`: for
// its
// parameter files.
OwnProgram own_program(const LaunchRecord& node, const PackageResolver& resolver,
                       const std::filesystem::path& folder);
OwnProgram own_command(const LaunchRecord& process, const std::vector<std::string>& words);

}  // namespace doppel
