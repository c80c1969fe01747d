#include "doppel/base/core/path_below.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

namespace fs = std::filesystem;

TEST(PathBelow, PathWithinFolderGivesItsNormalForm) {
  EXPECT_EQ(path_below("urdf/arm.urdf", "/bag"), fs::path("urdf/arm.urdf"));
  EXPECT_EQ(path_below("urdf/./a/../arm.urdf", "/bag/"), fs::path("urdf/arm.urdf"));
  EXPECT_EQ(path_below("/bag/urdf/arm.urdf", "/bag"), fs::path("urdf/arm.urdf"));
  EXPECT_EQ(path_below("/x/../bag/a", "/bag/b/.."), fs::path("a"));
  EXPECT_EQ(path_below("/etc/passwd", "/"), fs::path("etc/passwd"));
  EXPECT_EQ(path_below("..a/b", "/bag"), fs::path("..a/b"));
}

TEST(PathBelow, PathThatLeadsOutIsRefused) {
  for (const char* const path : {"..", "../a", "urdf/../../a", "urdf/../../bag2/a", "/bag/urdf/../../a",
                                 "/bag2/a", "/etc/passwd", "/", "./../bag/../a"})
    EXPECT_FALSE(path_below(path, "/bag")) << path;
}

TEST(PathBelow, FolderItselfIsRefused) {
  for (const char* const path : {"", ".", "a/..", "/bag", "/bag/", "../bag"})
    EXPECT_FALSE(path_below(path, "/bag")) << path;
  EXPECT_FALSE(path_below("/etc/passwd", "")) << "a recording without a root";
}

TEST(PathBelow, NulIsRefused) {
  EXPECT_FALSE(path_below(fs::path(std::string("a\0/../../b", 10)), "/bag"));
}

}  // namespace
}  // namespace doppel
