#include "doppel/base/core/arena.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>

namespace doppel {
namespace {

TEST(Arena, AllocationsAreAlignedAndDisjoint) {
  const unsigned seed = 20261121;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  Arena arena;
  struct Piece {
    unsigned char* at;
    std::size_t size;
    unsigned char mark;
  };
  std::vector<Piece> pieces;
  for (int i = 0; i < 5000; ++i) {
    const std::size_t size = random() % 50 == 0 ? random() % 60'000 : 1 + random() % 100;
    const std::size_t alignment = std::size_t{1} << (random() % 5);
    auto* const at = static_cast<unsigned char*>(arena.allocate(size, alignment));
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(at) % alignment, 0U);
    const auto mark = static_cast<unsigned char>(i);
    std::fill_n(at, size, mark);
    pieces.push_back({at, size, mark});
  }
  for (const Piece& piece : pieces) {
    for (std::size_t i = 0; i < piece.size; ++i) ASSERT_EQ(piece.at[i], piece.mark);
  }
}

TEST(Arena, CopiesOutliveSource) {
  Arena arena;
  std::string text = "shoulder_link";
  const std::string_view kept = arena.copy(text);
  text.assign("xxxxxxxxxxxxx");
  EXPECT_EQ(kept, "shoulder_link");
  EXPECT_EQ(arena.copy(std::string_view()), "");
  const int numbers[] = {3, 1, 2};
  const std::span<int> copy = arena.copy(std::span<const int>(numbers));
  EXPECT_EQ(copy.size(), 3U);
  EXPECT_EQ(copy[2], 2);
  EXPECT_EQ(arena.array<double>(4)[3], 0.0);
  EXPECT_TRUE(arena.array<double>(0).empty());
}

// Memory of a destroyed arena may be reused by the next one, but never by two at once.
TEST(Arena, ReusedBlockBelongsToOneArena) {
  const auto fill = [](Arena& arena, char mark) {
    std::vector<std::string_view> pieces;
    const std::string text(1000, mark);
    for (int i = 0; i < 500; ++i) pieces.push_back(arena.copy(text));
    return pieces;
  };
  for (int round = 0; round < 3; ++round) {
    Arena first, second;
    const auto ones = fill(first, '1'), twos = fill(second, '2');
    {
      Arena third;
      fill(third, '3');
    }
    Arena fourth;
    fill(fourth, '4');
    second = std::move(fourth);
    for (const std::string_view piece : ones) ASSERT_EQ(piece.find_first_not_of('1'), std::string_view::npos);
  }
}

TEST(Arena, MoveKeepsAllocations) {
  Arena first;
  const std::string_view kept = first.copy("elbow");
  const Arena second = std::move(first);
  EXPECT_EQ(kept, "elbow");
}

}  // namespace
}  // namespace doppel
