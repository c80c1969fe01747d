#pragma once
// The folder of a ROS package: where it begins, and what it is called.

#include <filesystem>
#include <string>

#include "doppel/export.h"

namespace doppel {

DOPPEL_API bool is_package(const std::filesystem::path& folder);
// The <name> of its package.xml; the folder's own name where it has none.
DOPPEL_API std::string package_name(const std::filesystem::path& folder);
// The innermost package that a file lies in; empty: none.
DOPPEL_API std::filesystem::path package_around(const std::filesystem::path& file);

}  // namespace doppel
