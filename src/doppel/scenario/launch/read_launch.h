#pragma once
// Reads a launch file: Python, XML and YAML of ROS 2, XML of ROS 1.

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/export.h"
#include "doppel/scenario/launch/launch_description.h"

namespace doppel {

// The launch file of one word (a file) or two (a package and a file in its folder launch). Throws InputError.
DOPPEL_API std::filesystem::path find_launch_file(const std::string& word, const std::string& file,
                                                  PackageResolver& resolver);

// Runs the file's Python (as `ros2 launch` does) in a process of its own, against modules that record
// instead of
// starting. Packages are found by `resolver`, which gets the file as a context; `folder` is for files that
// the
// launch file makes, and has to outlive the use of the result. Throws InputError: the file cannot be read, an
// argument is unknown or missing, or Python is not installed.
DOPPEL_API LaunchDescription read_launch(const std::filesystem::path& file, const NamedTexts& arguments,
                                         PackageResolver& resolver, const std::filesystem::path& folder);

}  // namespace doppel
