#pragma once
// Convex hulls as mesh files of their own.

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace doppel::overlay_detail {

// Binary STL in metres, in the user's cache folder, in a folder named by its content; nothing where the
// points enclose no volume. Throws InputError where it cannot be written.
std::optional<std::filesystem::path> write_hull(const std::vector<Eigen::Vector3d>& points,
                                                const std::string& name);

// The hulls of several parts, as STEM_1.stl, STEM_2.stl... in a folder named by `key`, which contains all
// inputs: where the files exist already, `parts` is not called.
using Parts = std::vector<std::vector<Eigen::Vector3d>>;
std::vector<std::filesystem::path> write_parts(const std::string& key, const std::string& stem,
                                               const std::function<Parts()>& parts);

}  // namespace doppel::overlay_detail
