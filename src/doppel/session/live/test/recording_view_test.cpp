#include "doppel/session/live/recording_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/mcap/mcap_records.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RecordingViewTest : public ::testing::Test {
 protected:
  RecordingViewTest() {
    char name[] = "/tmp/doppel_view_XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~RecordingViewTest() override { fs::remove_all(folder_); }

  std::string write(const fs::path& file, const std::string& text) const {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file, std::ios::binary) << text;
    return (folder_ / file).string();
  }
  // Begins as a recording that was not closed.
  std::string write_bag(const fs::path& file) const {
    return write(file, std::string(reinterpret_cast<const char*>(kMcapMagic), kMcapMagicSize) + "cut off");
  }
  [[nodiscard]] bool is_one(const fs::path& path) const { return is_recording((folder_ / path).string()); }

  fs::path folder_;
};

TEST_F(RecordingViewTest, FileIsRecordingByNameOrBeginning) {
  write("arm.urdf", "<robot name='a'/>");
  write("arm", "<robot name='a'/>");
  write("list.yaml", "metadata");
  write_bag("renamed");
  write("old", "#ROSBAG V2.0\n");
  write_bag("run.mcap");
  for (const char* path : {"run.mcap", "gone.mcap", "gone.bag", "gone.db3", "renamed", "old", "run"})
    EXPECT_TRUE(is_one(path)) << path;
  for (const char* path : {"arm.urdf", "arm", "list.yaml", "gone", "gone.urdf"})
    EXPECT_FALSE(is_one(path)) << path;
  EXPECT_FALSE(is_recording(""));
  EXPECT_FALSE(is_recording("omarm_one"));
}

TEST_F(RecordingViewTest, FolderOfDescriptionWithRecordingIsNone) {
  write_bag("bag/run_0.mcap");
  write("sqlite/run_0.db3", "SQLite format 3");
  write_bag("package/run.mcap");
  write("package/package.xml", "<package/>");
  write_bag("arm/run.mcap");
  write("arm/arm.urdf.xacro", "<robot/>");
  write("listed/metadata.yaml", "rosbag2_bagfile_information:\n  version: 9\n");
  write("listed/arm.urdf", "<robot/>");
  write("other/metadata.yaml", "name: other\n");
  fs::create_directories(folder_ / "empty");
  for (const char* path : {"bag", "bag/", "sqlite", "listed", "listed/metadata.yaml"})
    EXPECT_TRUE(is_one(path)) << path;
  for (const char* path : {"package", "arm", "other", "other/metadata.yaml", "empty"})
    EXPECT_FALSE(is_one(path)) << path;
}

TEST_F(RecordingViewTest, BagHasNameFilesAndNotes) {
  const std::string second = write_bag("run/run_2.mcap"), tenth = write_bag("run/run_10.mcap");
  const ViewedBag bag = open_viewed_bag((folder_ / "run/").string());
  EXPECT_EQ(bag.name, "run");
  EXPECT_TRUE(bag.is_folder);
  EXPECT_EQ(bag.files.size(), 2u);
  EXPECT_THAT(bag.files.back(), HasSubstr("run_10.mcap"));
  EXPECT_THAT(bag.notes, ElementsAre(HasSubstr("run_2.mcap: it was not closed"), HasSubstr("run_10.mcap")));
  EXPECT_EQ(open_viewed_bag(second).name, "run_2.mcap");
  EXPECT_FALSE(open_viewed_bag(tenth).is_folder);
}

TEST_F(RecordingViewTest, MissingFileIsRejectedWithNearName) {
  write_bag("first_run.mcap");
  try {
    (void)open_viewed_bag((folder_ / "frist_run.mcap").string());
    FAIL() << "it is opened";
  } catch (const InputError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("did you mean 'first_run.mcap'"));
  }
}

TEST_F(RecordingViewTest, AddressesOfPageHaveEscapedNamesAndTime) {
  const ViewedBag first = open_viewed_bag(write_bag("a & b.mcap"));
  const ViewedBag second = open_viewed_bag(write_bag("other/a & b.mcap"));
  write("page/index.html", "<!doctype html>");
  ServerEdgeOptions options;
  options.page_folder = folder_ / "page";
  options.token = "0123456789abcdef";
  const Log silent;
  const RecordingView view({first, second}, 2.5, options, silent);
  EXPECT_TRUE(view.has_token());
  EXPECT_THAT(view.page_url(), HasSubstr("/?token=0123456789abcdef&bag=recordings/1/a%2520%2526%2520b.mcap"
                                         "&bag2=recordings/2/a%2520%2526%2520b.mcap&t=2.5"));
  options.page_folder = folder_ / "nothing";
  EXPECT_THROW((RecordingView({first}, std::nullopt, options, silent)), InputError);
}

}  // namespace
}  // namespace doppel
