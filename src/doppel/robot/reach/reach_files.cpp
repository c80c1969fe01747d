#include "doppel/robot/reach/reach_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace doppel {
namespace {

template <typename Visit>
void for_each_reached(const ReachMap& map, Visit visit) {
  for (int z = 0; z < map.nz; ++z) {
    for (int y = 0; y < map.ny; ++y) {
      for (int x = 0; x < map.nx; ++x) {
        if (map.at(x, y, z).in_reach) visit(map.center(x, y, z), map.at(x, y, z));
      }
    }
  }
}

}  // namespace

MapColour map_colour(double value) {
  static constexpr std::array<std::array<double, 3>, 9> kColours = {{{68, 1, 84},
                                                                     {71, 44, 122},
                                                                     {59, 81, 139},
                                                                     {44, 113, 142},
                                                                     {33, 144, 141},
                                                                     {39, 173, 129},
                                                                     {92, 200, 99},
                                                                     {170, 220, 50},
                                                                     {253, 231, 37}}};
  const double scaled = std::clamp(value, 0.0, 1.0) * (kColours.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(scaled), kColours.size() - 2);
  const double part = scaled - static_cast<double>(low);
  const auto mixed = [&](std::size_t c) {
    return static_cast<int>(std::lround(kColours[low][c] + part * (kColours[low + 1][c] - kColours[low][c])));
  };
  return {mixed(0), mixed(1), mixed(2)};
}

std::string reach_csv(const ReachMap& map) {
  std::string out = "x,y,z,share,manipulability,limit_distance\n";
  for_each_reached(map, [&out](const Eigen::Vector3d& p, const ReachCell& cell) {
    out += fmt::format("{:.6g},{:.6g},{:.6g},{:.4g},{:.6g},{:.4g}\n", p.x(), p.y(), p.z(), cell.share,
                       cell.manipulability, cell.limit_distance);
  });
  return out;
}

std::string reach_ply(const ReachMap& map) {
  std::string points;
  std::size_t count = 0;
  for_each_reached(map, [&](const Eigen::Vector3d& p, const ReachCell& cell) {
    const MapColour c = map_colour(cell.share);
    points += fmt::format("{:.6g} {:.6g} {:.6g} {} {} {} {:.4g} {:.6g} {:.4g}\n", p.x(), p.y(), p.z(), c.r,
                          c.g, c.b, cell.share, cell.manipulability, cell.limit_distance);
    ++count;
  });
  return fmt::format(
             "ply\nformat ascii 1.0\ncomment doppel reach map, cells of {:.6g} m\nelement vertex "
             "{}\nproperty float "
             "x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty "
             "uchar "
             "blue\nproperty float share\nproperty float manipulability\nproperty float "
             "limit_distance\nend_header\n",
             map.cell, count) +
         points;
}

std::string reach_binary(const ReachMap& map) {
  static_assert(std::endian::native == std::endian::little);
  std::string out = fmt::format(
      "doppel reach map 1\n{{\"origin\": [{:.9g}, {:.9g}, {:.9g}], \"cell\": {:.9g}, \"nx\": {}, \"ny\": {}, "
      "\"nz\": "
      "{}, \"directions\": {}, \"fields\": [\"in_reach\", \"share\", \"manipulability\", "
      "\"limit_distance\"]}}\n",
      map.origin.x(), map.origin.y(), map.origin.z(), map.cell, map.nx, map.ny, map.nz, map.directions);
  for (const ReachCell& cell : map.cells) {
    const float values[4] = {cell.in_reach ? 1.0F : 0.0F, cell.share, cell.manipulability,
                             cell.limit_distance};
    out.append(reinterpret_cast<const char*>(values), sizeof values);
  }
  return out;
}

}  // namespace doppel
