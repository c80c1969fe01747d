// What a folder given as a target may contain beside its description.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class FolderTargetTest : public ::testing::Test {
 protected:
  FolderTargetTest() : folder_(fs::path(testing::TempDir()) / ("target_test." + std::to_string(getpid()))) {
    fs::create_directories(folder_ / "urdf");
    write("package.xml", "<package><name>arm</name></package>");
    write("urdf/arm.urdf", "<robot name=\"a\"><link name=\"l\"/></robot>");
  }
  ~FolderTargetTest() override { fs::remove_all(folder_); }
  void write(const std::string& file, const std::string& text) { std::ofstream(folder_ / file) << text; }
  fs::path found() { return resolve_target(folder_.string(), "").description.filename(); }

  fs::path folder_;
};

TEST_F(FolderTargetTest, PipesInFolderAreSkipped) {
  for (const char* name : {"urdf/pipe.urdf", "urdf/pipe.xacro"})
    ASSERT_EQ(mkfifo((folder_ / name).c_str(), 0600), 0);
  EXPECT_EQ(found(), "arm.urdf");
}

TEST_F(FolderTargetTest, HugeFilesAreNotChosen) {
  write("urdf/large.urdf", "<robot name=\"b\"><link name=\"l\"/></robot>");
  fs::resize_file(folder_ / "urdf/large.urdf", (std::uintmax_t{16} << 20) + 1);
  fs::create_directories(folder_ / "urdf/folder.urdf");
  EXPECT_EQ(found(), "arm.urdf");
}

}  // namespace
}  // namespace doppel
