#include "doppel/description/overlay/detail/convex_parts.h"

#include <gtest/gtest.h>

#include "doppel/description/meshes/convex_hull.h"

namespace doppel::overlay_detail {
namespace {

// A box's twelve triangles.
void add_box(std::vector<Triangle>& out, const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
  std::vector<Eigen::Vector3f> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back(i & 1 ? upper.x() : lower.x(), i & 2 ? upper.y() : lower.y(),
                         i & 4 ? upper.z() : lower.z());
  for (const auto& [a, b, c] : convex_hull(corners).triangles)
    out.push_back({corners[a].cast<double>(), corners[b].cast<double>(), corners[c].cast<double>()});
}

double volume(const std::vector<std::vector<Eigen::Vector3d>>& parts) {
  double sum = 0;
  for (const auto& part : parts) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3d& p : part) points.push_back(p.cast<float>());
    sum += convex_hull(points).volume;
  }
  return sum;
}

TEST(ConvexParts, BoxIsOnePart) {
  std::vector<Triangle> box;
  add_box(box, {0, 0, 0}, {0.1, 0.2, 0.3});
  const auto parts = convex_parts(box);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_NEAR(volume(parts), 0.006, 1e-9);
}

// A bracket of two plates: the volume of its hull is 3.5 times its own; two parts represent it exactly.
TEST(ConvexParts, BracketIsCutAtCorner) {
  std::vector<Triangle> bracket;
  add_box(bracket, {0, 0, 0}, {0.1, 0.05, 0.01});
  add_box(bracket, {0, 0, 0.01}, {0.01, 0.05, 0.1});
  const auto parts = convex_parts(bracket);
  EXPECT_EQ(parts.size(), 2U);
  EXPECT_NEAR(volume(parts), 0.1 * 0.05 * 0.01 + 0.01 * 0.05 * 0.09, 1e-8);
}

// A ring of four bars, whose hole is inside of any single hull.
TEST(ConvexParts, RingIsCut) {
  std::vector<Triangle> ring;
  add_box(ring, {0, 0, 0}, {0.1, 0.02, 0.02});
  add_box(ring, {0, 0.08, 0}, {0.1, 0.1, 0.02});
  add_box(ring, {0, 0.02, 0}, {0.02, 0.08, 0.02});
  add_box(ring, {0.08, 0.02, 0}, {0.1, 0.08, 0.02});
  const auto parts = convex_parts(ring);
  EXPECT_LE(parts.size(), 8U);
  EXPECT_NEAR(volume(parts), 0.02 * (0.01 - 0.0036), 2e-7);
}

TEST(ConvexParts, FlatSheetHasNoParts) {
  EXPECT_TRUE(convex_parts({{Eigen::Vector3d(0, 0, 0), {1, 0, 0}, {0, 1, 0}}}).empty());
  EXPECT_TRUE(convex_parts({}).empty());
}

}  // namespace
}  // namespace doppel::overlay_detail
