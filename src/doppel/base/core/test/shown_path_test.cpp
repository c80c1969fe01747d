#include "doppel/base/core/shown_path.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

TEST(ShownPath, PathBelowFolderIsRelative) {
  EXPECT_EQ(shown_path("/home/me/arm/urdf/arm.xacro", "/home/me/arm"), "urdf/arm.xacro");
  EXPECT_EQ(shown_path("/home/me/arm/./urdf/../arm.xacro", "/home/me/arm"), "arm.xacro");
  EXPECT_EQ(shown_path("/home/me/army/arm.xacro", "/home/me/arm"), "/home/me/army/arm.xacro");
  EXPECT_EQ(shown_path("/home/me", "/home/me/arm"), "/home/me");
  EXPECT_EQ(shown_path("", "/home/me/arm"), "");
}

TEST(ShownPath, RootFolderShortensNothing) {
  EXPECT_EQ(shown_path("/etc/arm.urdf", "/"), "/etc/arm.urdf");
}

TEST(ShownPath, WorkingFolderIsDefault) {
  const auto here = std::filesystem::current_path();
  EXPECT_EQ(shown_path(here / "arm.urdf"), "arm.urdf");
  EXPECT_EQ(shown_path("arm.urdf"), "arm.urdf");
  EXPECT_EQ(shown_path("<generated controllers>"), "<generated controllers>");
}

}  // namespace
}  // namespace doppel
