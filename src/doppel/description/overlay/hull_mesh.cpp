#include "doppel/description/overlay/detail/hull_mesh.h"

#include <fmt/format.h>
#include <unistd.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "doppel/base/core/fnv_hash.h"
#include "doppel/base/core/output_file.h"
#include "doppel/description/meshes/convex_hull.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel::overlay_detail {
namespace {

namespace fs = std::filesystem;

// The user's cache folder, or one that is always writable if that is not.
fs::path cache_folder() {
  fs::path folder;
  if (const char* named = std::getenv("XDG_CACHE_HOME"); named != nullptr && *named == '/') {
    folder = fs::path(named) / "doppel";
  } else if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/') {
    folder = fs::path(home) / ".cache" / "doppel";
  }
  std::error_code problem;
  if (!folder.empty()) fs::create_directories(folder, problem);
  if (folder.empty() || problem || access(folder.c_str(), W_OK) != 0)
    return fs::temp_directory_path() / fmt::format("doppel-{}", getuid());
  return folder;
}

static_assert(std::endian::native == std::endian::little, "STL is little-endian");

template <class Number>
void put(std::string& bytes, Number value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string binary_stl(const std::vector<Eigen::Vector3f>& points, const ConvexHull& hull) {
  std::string bytes(80, '\0');
  put(bytes, static_cast<std::uint32_t>(hull.triangles.size()));
  for (const auto& [a, b, c] : hull.triangles) {
    const Eigen::Vector3f normal = (points[b] - points[a]).cross(points[c] - points[a]).normalized();
    for (const Eigen::Vector3f& v : {normal, points[a], points[b], points[c]}) {
      for (const float x : v) put(bytes, x);
    }
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

}  // namespace

std::optional<fs::path> write_hull(const std::vector<Eigen::Vector3d>& points, const std::string& name) {
  std::vector<Eigen::Vector3f> corners;
  corners.reserve(points.size());
  for (const Eigen::Vector3d& p : points) corners.push_back(p.cast<float>());
  const ConvexHull hull = convex_hull(corners);
  if (hull.triangles.empty()) return std::nullopt;
  const std::string bytes = binary_stl(corners, hull);
  const fs::path folder = cache_folder() / fmt::format("hull_{:016x}", fnv_hash(bytes));
  const fs::path file = folder / name;
  std::error_code none;
  if (fs::is_regular_file(file, none) && fs::file_size(file, none) == bytes.size()) return file;
  fs::create_directories(folder, none);
  write_whole(file, bytes);
  return file;
}

std::vector<fs::path> write_parts(const std::string& key, const std::string& stem,
                                  const std::function<Parts()>& parts) {
  const fs::path folder = cache_folder() / fmt::format("hull_parts_{:016x}", fnv_hash(stem + '\n' + key));
  const fs::path list = folder / "complete";  // written last
  std::error_code none;
  const auto file = [&](std::size_t i) { return folder / fmt::format("{}_{}.stl", stem, i + 1); };
  std::vector<fs::path> out;
  if (fs::exists(list, none)) {
    while (fs::exists(file(out.size()), none)) out.push_back(file(out.size()));
    return out;
  }
  fs::create_directories(folder, none);
  for (const std::vector<Eigen::Vector3d>& corners : parts()) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3d& p : corners) points.push_back(p.cast<float>());
    const ConvexHull hull = convex_hull(points);
    if (hull.triangles.empty()) continue;
    write_whole(file(out.size()), binary_stl(points, hull));
    out.push_back(file(out.size()));
  }
  write_whole(list, key);
  return out;
}

}  // namespace doppel::overlay_detail
