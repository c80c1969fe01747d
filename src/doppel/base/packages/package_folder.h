#pragma once
// The folder of a ROS package and its name.

#include <filesystem>
#include <string>

#include "doppel/export.h"

namespace doppel {

DOPPEL_API bool is_package(const std::filesystem::path& folder);
// The <name> of its package.xml; the folder's name if it has none.
DOPPEL_API std::string package_name(const std::filesystem::path& folder);
// The innermost package that contains a file; empty: none.
DOPPEL_API std::filesystem::path package_around(const std::filesystem::path& file);
// The innermost model of Gazebo, a folder with a model.config, that contains a file; empty: none.
DOPPEL_API std::filesystem::path model_around(const std::filesystem::path& file);

}  // namespace doppel
