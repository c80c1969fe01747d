#pragma once
// The occupied part of an octomap, as octomap_msgs carries it. Sources: Hornung et al., "OctoMap: An
// efficient probabilistic 3D mapping framework based on octrees", 2013; readBinaryNode and readNodesRecurs of
// octomap 1.9.

#include <cstdint>
#include <span>
#include <string>

#include "doppel/export.h"
#include "doppel/robot/scene_objects/scene_object.h"

namespace doppel {

inline constexpr int kOctomapLevels = 16;
inline constexpr std::size_t kMaxOctomapLeaves = 2'000'000, kMaxOctomapBoxes = 20'000;

struct OctomapBytes {
  std::string id;         // "OcTree": the only kind that is read
  double resolution = 0;  // m, of the smallest cells
  bool binary = true;     // two bits for each child; else its log odds, occupied from 0 on
  std::span<const std::uint8_t> data;
};

// Occupied leaves, joined to boxes where they fill one, in the map's frame; empty for a map without data.
// Unknown space counts as free. Throws InputError, rule "octomap.data": another kind, a resolution that is
// not positive, data that end too early or too late; "octomap.size": more leaves or boxes than the limits.
[[nodiscard]] DOPPEL_API SharedCells occupied_cells(const OctomapBytes& map);

}  // namespace doppel
