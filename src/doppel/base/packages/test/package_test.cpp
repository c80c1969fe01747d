// Packages are found as colcon finds them, and in the folders of a downloaded collection.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "doppel/base/packages/package_index.h"
#include "doppel/base/packages/package_resolver.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class PackageResolverTest : public ::testing::Test {
 protected:
  PackageResolverTest()
      : folder_(fs::temp_directory_path() / ("doppel_packages_" + std::to_string(::getpid()))) {
    for (const char* name : kVariables) ::unsetenv(name);
    fs::create_directories(folder_);
  }
  ~PackageResolverTest() override {
    for (const char* name : kVariables) ::unsetenv(name);
    fs::remove_all(folder_);
  }

  void write(const std::string& file, const std::string& text = "") {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << text;
  }
  void package(const std::string& path) {
    write(path + "/package.xml",
          "<package><name>" + fs::path(path).filename().string() + "</name></package>");
  }
  // The folder of a package that a file refers to, relative to the test's folder; "" if it is not found.
  std::string find(const std::string& name, const std::string& from) {
    PackageResolver resolver;
    resolver.add_context(folder_ / from);
    const fs::path found = resolver.find_package(name).path;
    return found.empty() ? "" : found.lexically_relative(folder_).string();
  }

  static constexpr const char* kVariables[] = {"ROS_PACKAGE_PATH",   "AMENT_PREFIX_PATH",
                                               "COLCON_PREFIX_PATH", "GZ_SIM_RESOURCE_PATH",
                                               "GAZEBO_MODEL_PATH",  "IGN_GAZEBO_RESOURCE_PATH"};
  fs::path folder_;
};

TEST_F(PackageResolverTest, PackageIsFoundInWorkspace) {
  package("ws/src/a/arm_bringup");
  package("ws/src/b/deep/down/arm_description");
  write("ws/src/a/arm_bringup/urdf/arm.urdf");
  EXPECT_EQ(find("arm_description", "ws/src/a/arm_bringup/urdf/arm.urdf"),
            "ws/src/b/deep/down/arm_description");
}

TEST_F(PackageResolverTest, SearchedPlacesAreListedOnce) {
  package("ws/src/a/arm_bringup");
  PackageResolver resolver;
  for (const char* from : {"ws/src/a/arm_bringup/urdf/arm.urdf", "ws/src/a/arm_bringup/urdf/arm.urdf",
                           "ws/src/a/arm_bringup/config/x.xacro", "ws/src/a/other.xacro"})
    resolver.add_context(folder_ / from);
  std::vector<std::string> tried = resolver.find_package("arm_descripton").tried;
  ASSERT_FALSE(tried.empty());
  std::sort(tried.begin(), tried.end());
  EXPECT_EQ(std::adjacent_find(tried.begin(), tried.end()), tried.end())
      << *std::adjacent_find(tried.begin(), tried.end());
}

TEST_F(PackageResolverTest, FolderIgnoredByColconIsNotFound) {
  package("ws/src/a/arm");
  for (const char* marker : {"COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE"}) {
    package(std::string("ws/src/with_") + marker + "/of_" + marker);
    write(std::string("ws/src/with_") + marker + "/" + marker);
    EXPECT_EQ(find(std::string("of_") + marker, "ws/src/a/arm/x.urdf"), "") << marker;
  }
  for (const char* folder : {"build", "log", ".git", "node_modules", "install"}) {
    package(std::string("ws/src/b/") + folder + "/hidden");
    EXPECT_EQ(find("hidden", "ws/src/a/arm/x.urdf"), "") << folder;
  }
  package("ws/src/b/outer");
  package("ws/src/b/outer/inner");
  EXPECT_EQ(find("inner", "ws/src/a/arm/x.urdf"), "") << "expected no result: a package inside a package";
  EXPECT_EQ(find("outer", "ws/src/a/arm/x.urdf"), "ws/src/b/outer");
}

TEST_F(PackageResolverTest, PackageInRepositoryIsFoundWithoutWorkspace) {
  fs::create_directories(folder_ / "repo/.git");
  package("repo/robots/x/arm");
  package("repo/common/parts/meshes_of_all");
  EXPECT_EQ(find("meshes_of_all", "repo/robots/x/arm/urdf/arm.urdf"), "repo/common/parts/meshes_of_all");
}

TEST_F(PackageResolverTest, FolderOfSameNameIsFoundWithoutManifest) {
  write("collection/arm_description/urdf/arm.urdf");
  write("collection/hand_description/meshes/palm.stl");
  write("collection/vendors/nested/tool_description/meshes/tool.stl");
  const std::string from = "collection/arm_description/urdf/arm.urdf";
  EXPECT_EQ(find("arm_description", from), "collection/arm_description") << "expected an ancestor";
  EXPECT_EQ(find("hand_description", from), "collection/hand_description")
      << "expected a sibling of an ancestor";
  EXPECT_EQ(find("tool_description", from), "collection/vendors/nested/tool_description")
      << "expected a package in a subfolder";
}

TEST_F(PackageResolverTest, PackageIsPreferredToFolderOfSameName) {
  fs::create_directories(folder_ / "arm_description/.git");
  package("arm_description/src/arm_description");
  write("arm_description/bringup/arm.urdf");
  EXPECT_EQ(find("arm_description", "arm_description/bringup/arm.urdf"),
            "arm_description/src/arm_description");
}

// A folder beside the workspace that is only named like the package.
TEST_F(PackageResolverTest, PackageOfEnvironmentIsPreferredToFolderOfSameName) {
  package("ws/src/robot");
  write("ws/src/robot/urdf/r.urdf");
  write("arm_meshes/notes/readme.txt");
  package("other/arm_meshes");
  ::setenv("ROS_PACKAGE_PATH", (folder_ / "other").c_str(), 1);
  EXPECT_EQ(find("arm_meshes", "ws/src/robot/urdf/r.urdf"), "other/arm_meshes");
}

TEST_F(PackageResolverTest, PackageInsideFolderOfSameNameIsFound) {
  package("ws/src/robot");
  write("ws/src/robot/urdf/r.urdf");
  package("arm_meshes/src/arm_meshes");
  EXPECT_EQ(find("arm_meshes", "ws/src/robot/urdf/r.urdf"), "arm_meshes/src/arm_meshes");
}

TEST_F(PackageResolverTest, FileWithoutPackageIsFoundBesideDescription) {
  write("export/arm.urdf");
  write("export/part.stl");
  write("export/meshes/base.stl");
  package("ws/src/parts");
  write("ws/src/parts/meshes/link.stl");
  PackageResolver resolver;
  resolver.add_context(folder_ / "export/arm.urdf");
  resolver.add_context(folder_ / "ws/src/parts/package.xml");
  const auto resolved = [&](const std::string& uri) {
    return resolver.resolve(uri, folder_ / "export").path.lexically_relative(folder_).string();
  };
  EXPECT_EQ(resolved("package:///part.stl"), "export/part.stl");
  EXPECT_EQ(resolved("package://part.stl"), "export/part.stl");
  EXPECT_EQ(resolved("package:///meshes/base.stl"), "export/meshes/base.stl");
  EXPECT_EQ(resolved("package:///parts/meshes/link.stl"), "ws/src/parts/meshes/link.stl");
  const PackageResolver::Resolved missing = resolver.resolve("package:///absent.stl", folder_ / "export");
  EXPECT_TRUE(missing.path.empty());
  EXPECT_EQ(missing.tried.front(), (folder_ / "export/absent.stl").string());
}

TEST_F(PackageResolverTest, InstalledPackageIsFoundInEveryLayout) {
  package("ws/src/arm");
  package("ws/install/share/together");
  package("ws/install/apart/share/apart");
  EXPECT_EQ(find("together", "ws/src/arm/arm.urdf"), "ws/install/share/together");
  EXPECT_EQ(find("apart", "ws/src/arm/arm.urdf"), "ws/install/apart/share/apart");
}

TEST_F(PackageResolverTest, EnvironmentVariablesAreSearched) {
  package("ros1/stack/deep/crawled");
  package("prefix/share/installed");
  package("colcon/isolated/share/isolated");
  write("models/chair/meshes/chair.dae");
  write("elsewhere/arm.urdf");
  ::setenv("ROS_PACKAGE_PATH", (folder_ / "ros1").c_str(), 1);
  ::setenv("AMENT_PREFIX_PATH", ("/none:" + (folder_ / "prefix").string()).c_str(), 1);
  ::setenv("COLCON_PREFIX_PATH", (folder_ / "colcon").c_str(), 1);
  ::setenv("IGN_GAZEBO_RESOURCE_PATH", (folder_ / "models").c_str(), 1);
  EXPECT_EQ(find("crawled", "elsewhere/arm.urdf"), "ros1/stack/deep/crawled");
  EXPECT_EQ(find("installed", "elsewhere/arm.urdf"), "prefix/share/installed");
  EXPECT_EQ(find("isolated", "elsewhere/arm.urdf"), "colcon/isolated/share/isolated");
  EXPECT_EQ(find("chair", "elsewhere/arm.urdf"), "models/chair");
}

TEST_F(PackageResolverTest, MissingPackageListsSearchedPlaces) {
  package("ws/src/arm");
  PackageResolver resolver;
  resolver.add_context(folder_ / "ws/src/arm/arm.urdf");
  const auto first = resolver.find_package("arn");
  EXPECT_TRUE(first.path.empty());
  EXPECT_EQ(first.nearest, "arm");
  EXPECT_FALSE(first.tried.empty());
  EXPECT_EQ(resolver.find_package("arn").tried, first.tried)
      << "expected the same report at the second search";
  EXPECT_TRUE(resolver.find_package("..").path.empty());
  EXPECT_TRUE(resolver.find_package("").path.empty());
}

TEST_F(PackageResolverTest, MissingFileIsTakenFromOtherFolderOfSameName) {
  package("ws/src/arm_description");
  write("ws/assets/arm_description/meshes/link.stl");
  write("ws/assets/robot/arm.urdf");
  PackageResolver resolver;
  resolver.add_context(folder_ / "ws/assets/robot/arm.urdf");
  EXPECT_EQ(resolver.resolve("package://arm_description/meshes/link.stl", folder_).path,
            folder_ / "ws/assets/arm_description/meshes/link.stl");
}

TEST_F(PackageResolverTest, CrawlIsBounded) {
  std::string deep = "deep";
  for (int i = 0; i < 12; ++i) deep += "/d" + std::to_string(i);
  package(deep + "/too_deep");
  package("deep/d0/d1/near");
  const PackageIndex index = crawl_packages(folder_ / "deep");
  EXPECT_EQ(index.packages.count("near"), 1U);
  EXPECT_EQ(index.packages.count("too_deep"), 0U);
  fs::create_directory_symlink(folder_ / "deep", folder_ / "deep/d0/back");
  EXPECT_EQ(crawl_packages(folder_ / "deep").folders.count("back"), 0U)
      << "expected a link to an ancestor not to be followed";
}

}  // namespace
}  // namespace doppel
