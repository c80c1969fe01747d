#pragma once
// Convex hulls as mesh files of their own.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace doppel::overlay_detail {

// Binary STL in metres, in the user's cache folder, in a folder named by its content; nothing where the
// points enclose no volume. Throws InputError where it cannot be written.
std::optional<std::filesystem::path> write_hull(const std::vector<Eigen::Vector3d>& points,
                                                const std::string& name);

}  // namespace doppel::overlay_detail
