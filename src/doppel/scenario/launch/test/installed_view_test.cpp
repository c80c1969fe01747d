// The installed layout of a package, as its CMakeLists.txt has it.
#include "doppel/scenario/launch/detail/installed_view.h"

#include <sys/stat.h>

#include "doppel/scenario/launch/test/launch_fixture.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class InstalledViewTest : public LaunchFixture {
 protected:
  fs::path view(const std::string& cmake) {
    write("arm_description/CMakeLists.txt", cmake);
    return view();
  }
  fs::path view() {
    fs::remove_all(workspace_ / "view");
    return installed_view(workspace_ / "arm_description", "arm_description", workspace_ / "view");
  }
};

TEST_F(InstalledViewTest, FoldersAreWhereTheyAreInstalled) {
  const fs::path share = view(
      "# install( of the description (urdf)\ninstall(DIRECTORY urdf  # all ) of it\n"
      "  DESTINATION share/${PROJECT_NAME}/robots)\ninstall(");
  EXPECT_TRUE(fs::exists(share / "robots/urdf/arm.urdf.xacro"));
  EXPECT_TRUE(view("install(DIRECTORY urdf DESTINATION share/${PROJECT_NAME})").empty());
}

// 130,000 commands, each without its end, or all with one: a search from each to the end takes minutes.
TEST_F(InstalledViewTest, CommandsWithoutEndAreReadOnce) {
  std::string commands;
  while (commands.size() < (std::size_t{1} << 20) - 16) commands += "install(";
  EXPECT_TRUE(view(commands).empty());
  EXPECT_TRUE(view(commands + ")").empty());
}

TEST_F(InstalledViewTest, WhatIsNoFileOfUsualSizeHasNoRules) {
  const fs::path cmake = workspace_ / "arm_description/CMakeLists.txt";
  EXPECT_FALSE(view("install(DIRECTORY urdf DESTINATION share/arm_description/robots)").empty());
  fs::resize_file(cmake, (std::size_t{1} << 20) + 1);
  EXPECT_TRUE(view().empty());
  fs::remove(cmake);
  fs::create_symlink("/dev/zero", cmake);
  EXPECT_TRUE(view().empty());
  fs::remove(cmake);
  ASSERT_EQ(mkfifo(cmake.c_str(), 0600), 0);
  EXPECT_TRUE(view().empty());
}

}  // namespace
}  // namespace doppel
