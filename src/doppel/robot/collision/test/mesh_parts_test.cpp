// The convex parts of the meshes of a world.
#include "doppel/robot/collision/detail/mesh_parts.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

// Appends a box, facing outwards or inwards.
void add_box(TriangleMesh& mesh, const Eigen::Vector3f& centre, const Eigen::Vector3f& size,
             bool inwards = false) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3f sign(i & 1 ? 0.5F : -0.5F, i & 2 ? 0.5F : -0.5F, i & 4 ? 0.5F : -0.5F);
    mesh.vertices.emplace_back(centre + sign.cwiseProduct(size));
  }
  const std::array<std::uint32_t, 4> faces[] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    for (const std::array<std::size_t, 3>& t : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 3}}) {
      std::array<std::uint32_t, 3> triangle{first + f[t[0]], first + f[t[1]], first + f[t[2]]};
      if (inwards) std::swap(triangle[1], triangle[2]);
      mesh.triangles.push_back(triangle);
    }
  }
}

TEST(MeshParts, ConvexSurfacesStayWhole) {
  TriangleMesh table;
  add_box(table, {0, 0, 1}, {2, 1, 0.1F});
  for (const float x : {-0.9F, 0.9F}) add_box(table, {x, 0, 0.5F}, {0.1F, 0.1F, 0.8F});
  const MeshParts made = static_parts(table);
  ASSERT_EQ(made.parts.size(), 3u);
  for (const auto& part : made.parts) EXPECT_EQ(part.size(), 8u);
  EXPECT_EQ(made.filled, 0u);
}

TEST(MeshParts, MovingShelfHasOneHullForEachOfItsSurfaces) {
  TriangleMesh shelf;
  for (const float z : {0.5F, 1.5F}) add_box(shelf, {0, 0, z}, {2, 0.5F, 0.05F});
  for (const float x : {-0.9F, 0.9F}) add_box(shelf, {x, 0, 1}, {0.1F, 0.5F, 2});
  const MeshParts made = moving_parts(shelf);
  ASSERT_EQ(made.parts.size(), 4u);
  for (const auto& part : made.parts) EXPECT_EQ(part.size(), 8u);
  TriangleMesh pile;
  for (std::size_t i = 0; i <= kMaxMovingParts; ++i)
    add_box(pile, {0, 0, static_cast<float>(i)}, {0.5F, 0.5F, 0.5F});
  const MeshParts joined = moving_parts(pile);
  EXPECT_EQ(joined.parts.size(), 1u);
  EXPECT_EQ(joined.joined, kMaxMovingParts + 1);
}

TEST(MeshParts, RoomStaysHollow) {
  TriangleMesh room;
  add_box(room, {0, 0, 0}, {4, 4, 3}, true);
  room.triangles.resize(room.triangles.size() - 2);  // a door, so that the surface is open
  add_box(room, {1.9F, 0, 0}, {0.3F, 1, 1});
  const auto corner = static_cast<std::uint32_t>(room.vertices.size() - 8);
  room.triangles.push_back({corner, 0, 1});  // connected with the walls, so that the whole is not convex
  const MeshParts made = static_parts(room);
  EXPECT_GT(made.parts.size(), 10u);
  for (const auto& part : made.parts) {
    Eigen::AlignedBox3f bounds;
    for (const Eigen::Vector3f& p : part) bounds.extend(p);
    EXPECT_FALSE(bounds.contains(Eigen::Vector3f(-1, 0.3F, 0.2F)))
        << "expected the middle of the room to be free";
  }
}

TEST(MeshParts, LargeSurfaceBecomesItsHull) {
  TriangleMesh waves;
  constexpr std::uint32_t kSide = 40;
  for (std::uint32_t i = 0; i < kSide * kSide; ++i)
    waves.vertices.emplace_back(static_cast<float>(i % kSide), static_cast<float>(i / kSide),
                                i % 2 == 0 ? 0.0F : 1.0F);
  for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
    for (std::uint32_t x = 0; x + 1 < kSide; ++x)
      waves.triangles.push_back({y * kSide + x, y * kSide + x + 1, (y + 1) * kSide + x});
  }
  const MeshParts made = static_parts(waves);
  EXPECT_EQ(made.filled, 1u);
  EXPECT_EQ(made.parts.size(), 1u);
}

}  // namespace
}  // namespace doppel
