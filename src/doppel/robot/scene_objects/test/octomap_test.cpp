// The data of octomaps against the library that writes them (octomap 1.9).
#include "doppel/robot/scene_objects/octomap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include <algorithm>
#include <random>
#include <sstream>

namespace doppel {
namespace {

using testing::HasSubstr;

constexpr double kResolution = 0.05;

std::vector<std::uint8_t> data_of(octomap::OcTree& tree, bool binary) {
  std::ostringstream out;
  if (binary) {
    tree.writeBinaryData(out);
  } else {
    tree.writeData(out);
  }
  const std::string text = out.str();
  return {text.begin(), text.end()};
}

bool is_inside(const SharedCells& cells, const Eigen::Vector3d& p) {
  return std::ranges::any_of(*cells, [&p](const Eigen::AlignedBox3d& box) { return box.contains(p); });
}

// A room with a table, seen from a point: rays make free space and occupied ends.
octomap::OcTree random_map(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> in(-1, 1);
  octomap::OcTree out(kResolution);
  for (int i = 0; i < 3000; ++i) {
    const octomap::point3d end(static_cast<float>(in(random)), static_cast<float>(in(random)),
                               static_cast<float>(0.3 * in(random)));
    out.insertRay(octomap::point3d(0, 0, 0.8F), end);
  }
  for (double x = 0.4; x < 0.8; x += 0.02) {  // a block, which is pruned to larger leaves
    for (double y = 0.4; y < 0.8; y += 0.02) {
      for (double z = 0; z < 0.4; z += 0.02) out.updateNode(x, y, z, true, true);
    }
  }
  out.updateInnerOccupancy();
  return out;
}

TEST(Octomap, OccupiedCellsAreThoseOfItsLibrary) {
  SCOPED_TRACE("seed 71");
  for (const bool binary : {true, false}) {
    octomap::OcTree tree = random_map(71);
    if (binary) tree.toMaxLikelihood();
    const std::vector<std::uint8_t> data = data_of(tree, binary);
    const SharedCells cells = occupied_cells({"OcTree", kResolution, binary, data});
    std::mt19937 random(72);
    std::uniform_real_distribution<double> in(-1.2, 1.2);
    int occupied = 0;
    for (int i = 0; i < 20000; ++i) {
      const Eigen::Vector3d p(in(random), in(random), in(random));
      const auto* node = tree.search(p.x(), p.y(), p.z());
      const bool expected = node != nullptr && tree.isNodeOccupied(node);
      ASSERT_EQ(is_inside(cells, p), expected) << p.transpose();
      occupied += expected ? 1 : 0;
    }
    EXPECT_GT(occupied, 200);
    std::size_t leaves = 0;
    for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
      leaves += tree.isNodeOccupied(*leaf) ? 1 : 0;
    EXPECT_LT(cells->size(), leaves) << "expected leaves to be joined";
  }
}

TEST(Octomap, BlockBecomesFewBoxesOfItsVolume) {
  octomap::OcTree tree(kResolution);
  for (double x = 0.025; x < 0.5; x += kResolution) {
    for (double y = 0.025; y < 0.3; y += kResolution) {
      for (double z = 0.025; z < 0.2; z += kResolution) tree.updateNode(x, y, z, true);
    }
  }
  const SharedCells cells = occupied_cells({"OcTree", kResolution, true, data_of(tree, true)});
  EXPECT_LE(cells->size(), 4u)
      << "expected 240 cells, of which leaves of several sizes are made, to be joined";
  Eigen::AlignedBox3d around;
  double volume = 0;
  for (const Eigen::AlignedBox3d& cell : *cells) {
    around.extend(cell);
    volume += cell.volume();
  }
  EXPECT_TRUE(around.sizes().isApprox(Eigen::Vector3d(0.5, 0.3, 0.2), 1e-9));
  EXPECT_NEAR(volume, 0.03, 1e-12);
}

TEST(Octomap, DamagedDataAreRefusedWithTheirReason) {
  octomap::OcTree tree = random_map(73);
  const auto refusal = [](const OctomapBytes& map) -> std::string {
    try {
      (void)occupied_cells(map);
    } catch (const InputError& problem) {
      return problem.what();
    }
    return "";
  };
  const std::vector<std::uint8_t> full = data_of(tree, false);
  tree.toMaxLikelihood();
  const std::vector<std::uint8_t> data = data_of(tree, true);
  EXPECT_EQ(refusal({"OcTree", kResolution, true, data}), "");
  EXPECT_EQ(refusal({"OcTree", kResolution, true, {}}), "") << "no data are no map";
  for (std::size_t size = 1; size < data.size(); size += 7) {
    ASSERT_THAT(refusal({"OcTree", kResolution, true, std::span(data).first(size)}),
                HasSubstr("within a node"));
  }
  ASSERT_THAT(refusal({"OcTree", kResolution, false, std::span(full).first(full.size() - 1)}),
              HasSubstr("within a node"));
  std::vector<std::uint8_t> longer = data;
  longer.push_back(0);
  EXPECT_THAT(refusal({"OcTree", kResolution, true, longer}), HasSubstr("after its last node"));
  EXPECT_THAT(refusal({"ColorOcTree", kResolution, true, data}), HasSubstr("of the kind 'ColorOcTree'"));
  EXPECT_THAT(refusal({"OcTree", 0, true, data}), HasSubstr("has cells of 0 m"));
  const std::vector<std::uint8_t> deep(2000, 0xFF);  // every child is an inner node
  EXPECT_THAT(refusal({"OcTree", kResolution, true, deep}), HasSubstr("below level 16"));
}

// The binary data of a tree, depth first: each node has eight children, and those of the last level are what
// `leaves` says, in two bits each.
void add_node(int level, std::uint16_t leaves, std::vector<std::uint8_t>& out) {
  constexpr std::uint16_t kInner = 0xFFFF;
  const std::uint16_t bits = level == 0 ? leaves : kInner;
  out.push_back(static_cast<std::uint8_t>(bits & 0xFFU));
  out.push_back(static_cast<std::uint8_t>(bits >> 8U));
  if (level == 0) return;
  for (int child = 0; child < 8; ++child) add_node(level - 1, leaves, out);
}

// The number of boxes, or the reason why there are none.
std::string boxes_of_tree(int levels, std::uint16_t leaves) {
  std::vector<std::uint8_t> data;
  add_node(levels, leaves, data);
  try {
    return std::to_string(occupied_cells({"OcTree", kResolution, true, data})->size());
  } catch (const InputError& problem) {
    return problem.what();
  }
}

TEST(Octomap, LeavesAndBoxesBeyondTheirNumbersAreRefused) {
  constexpr std::uint16_t kAllOccupied = 0xAAAA, kFirstOccupied = 0x0002;
  EXPECT_EQ(boxes_of_tree(3, kAllOccupied), "1") << "expected 4096 leaves to be joined";
  EXPECT_THAT(boxes_of_tree(6, kAllOccupied), HasSubstr("has more than 2000000 occupied leaves"));
  EXPECT_EQ(boxes_of_tree(4, kFirstOccupied), "4096") << "no two touch each other";
  EXPECT_THAT(boxes_of_tree(5, kFirstOccupied), HasSubstr("has 32768 separate boxes, more than 20000"));
}

}  // namespace
}  // namespace doppel
