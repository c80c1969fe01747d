#include "doppel/robot/scene_objects/octomap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "doppel/robot/collision/size_limits.h"

namespace doppel {
namespace {

constexpr double kMaxCell = 10;  // m

[[noreturn]] void refuse_map(const char* rule, const std::string& why, const std::string& fix) {
  throw InputError(rule, {}, "the octomap " + why, fix);
}

// In units of the smallest cells, from the corner of the root.
struct CellBox {
  std::array<int, 3> low{}, high{};
};

// Nodes follow each other depth first. A binary node has two bits for each child; another one its log odds
// and one bit for each child.
class TreeReader {
 public:
  explicit TreeReader(const OctomapBytes& map) : map_(map) {}

  std::vector<CellBox> read() {
    read_node({0, 0, 0}, kOctomapLevels);
    if (next_ != map_.data.size()) {
      refuse_map("octomap.data", fmt::format("has {} bytes after its last node", map_.data.size() - next_),
                 "send the data of octomap_msgs::binaryMapToMsg or fullMapToMsg");
    }
    return std::move(boxes_);
  }

 private:
  // `level`: the logarithm of the node's side in cells.
  void read_node(const std::array<int, 3>& low, int level) {
    if (map_.binary) {
      read_binary(low, level);
    } else {
      read_full(low, level);
    }
  }

  void read_binary(const std::array<int, 3>& low, int level) {
    enum Child { unknown, occupied, free, inner };  // the order of two bits, the first one the lower
    require_depth(level);
    const unsigned bits = take() | static_cast<unsigned>(take()) << 8;
    const auto kind = [bits](int child) {
      const unsigned two = bits >> (2 * child) & 3;
      return two == 3 ? inner : two == 1 ? free : two == 2 ? occupied : unknown;
    };
    for (int child = 0; child < 8; ++child) {
      if (kind(child) == occupied) add(corner(low, level, child), level - 1);
    }
    for (int child = 0; child < 8; ++child) {
      if (kind(child) == inner) read_node(corner(low, level, child), level - 1);
    }
  }

  void read_full(const std::array<int, 3>& low, int level) {
    std::array<std::uint8_t, 4> bytes{};
    for (std::uint8_t& byte : bytes) byte = take();
    const float log_odds = std::bit_cast<float>(bytes);
    if (std::isnan(log_odds)) refuse_map("octomap.data", "has a node that is not a number", "send it again");
    const unsigned children = take();
    if (children == 0) {
      if (log_odds >= 0) add(low, level);
      return;
    }
    require_depth(level);
    for (int child = 0; child < 8; ++child) {
      if (children >> child & 1) read_node(corner(low, level, child), level - 1);
    }
  }

  static std::array<int, 3> corner(const std::array<int, 3>& low, int level, int child) {
    const int half = 1 << (level - 1);
    return {low[0] + (child & 1 ? half : 0), low[1] + (child & 2 ? half : 0),
            low[2] + (child & 4 ? half : 0)};
  }

  static void require_depth(int level) {
    if (level == 0)
      refuse_map("octomap.data", fmt::format("has nodes below level {}", kOctomapLevels), "send it again");
  }

  std::uint8_t take() {
    if (next_ == map_.data.size())
      refuse_map("octomap.data", fmt::format("ends after {} bytes, within a node", next_), "send it again");
    return map_.data[next_++];
  }

  void add(const std::array<int, 3>& low, int level) {
    if (boxes_.size() >= kMaxOctomapLeaves) {
      refuse_map("octomap.size", fmt::format("has more than {} occupied leaves", kMaxOctomapLeaves),
                 "send a coarser or smaller one");
    }
    const int side = 1 << level;
    boxes_.push_back({low, {low[0] + side, low[1] + side, low[2] + side}});
  }

  const OctomapBytes& map_;
  std::size_t next_ = 0;
  std::vector<CellBox> boxes_;
};

// Joins boxes that follow each other along an axis and are equal across it.
void join_along(int axis, std::vector<CellBox>& boxes) {
  const auto a = static_cast<std::size_t>(axis), b = (a + 1) % 3, c = (a + 2) % 3;
  const auto across = [&](const CellBox& box) {
    return std::array{box.low[b], box.high[b], box.low[c], box.high[c]};
  };
  std::ranges::sort(boxes, {}, [&](const CellBox& box) { return std::pair(across(box), box.low[a]); });
  std::size_t count = 0;
  for (const CellBox& box : boxes) {
    CellBox* const last = count > 0 ? &boxes[count - 1] : nullptr;
    if (last != nullptr && across(*last) == across(box) && last->high[a] == box.low[a]) {
      last->high[a] = box.high[a];
    } else {
      boxes[count++] = box;
    }
  }
  boxes.resize(count);
}

}  // namespace

SharedCells occupied_cells(const OctomapBytes& map) {
  auto out = std::make_shared<std::vector<Eigen::AlignedBox3d>>();
  if (map.data.empty()) return out;
  if (map.id != "OcTree") {
    refuse_map("octomap.data", fmt::format("is of the kind '{}', which is not read", map.id),
               "send an OcTree, without colours or time stamps");
  }
  if (!(map.resolution >= kMinShapeSize) || !(map.resolution <= kMaxCell)) {
    refuse_map("octomap.data", fmt::format("has cells of {:.3g} m", map.resolution),
               fmt::format("cells are from {:.3g} to {:.3g} m", kMinShapeSize, kMaxCell));
  }
  std::vector<CellBox> boxes = TreeReader(map).read();
  for (std::size_t before = boxes.size() + 1; boxes.size() < before;) {
    before = boxes.size();
    for (const int axis : {0, 1, 2}) join_along(axis, boxes);
  }
  if (boxes.size() > kMaxOctomapBoxes) {
    refuse_map("octomap.size",
               fmt::format("has {} separate boxes, more than {}", boxes.size(), kMaxOctomapBoxes),
               "send a coarser or smaller one");
  }
  const double half = 0.5 * (1 << kOctomapLevels);
  const auto point = [&](const std::array<int, 3>& cell) {
    return Eigen::Vector3d(map.resolution * (Eigen::Vector3d(cell[0], cell[1], cell[2]).array() - half));
  };
  for (const CellBox& box : boxes) {
    const Eigen::AlignedBox3d& cell = out->emplace_back(point(box.low), point(box.high));
    if (std::max(cell.min().cwiseAbs().maxCoeff(), cell.max().cwiseAbs().maxCoeff()) > kMaxDistance)
      refuse_map("octomap.data", "has occupied cells beyond 10 km", "send the part around the robot");
  }
  return out;
}

}  // namespace doppel
