// The journal has the bytes with which the run continues.
#include "doppel/session/live/detail/edited_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class EditedFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / "edited_files" / info->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void save(const std::string& text) const { std::ofstream(file()) << text; }
  [[nodiscard]] fs::path file() const { return folder_ / "arm.urdf"; }
  [[nodiscard]] FileVersions now() const { return {{file(), FileVersion::of(file())}}; }

  fs::path folder_;
};

TEST_F(EditedFilesTest, ChangedFileHasItsBytes) {
  save("1");
  const FileVersions before = now();
  EXPECT_TRUE(edited_files(before, now()).files.empty());
  save("22");
  const auto edited = edited_files(before, now());
  ASSERT_EQ(edited.files.size(), 1U);
  EXPECT_EQ(edited.files[0].path, file().string());
  EXPECT_FALSE(edited.files[0].removed);
  EXPECT_EQ(std::string(edited.files[0].data.begin(), edited.files[0].data.end()), "22");
  fs::remove(file());
  EXPECT_TRUE(edited_files(before, now()).files.at(0).removed);
}

TEST_F(EditedFilesTest, FileThatWasSavedAfterItWasReadIsRefused) {
  save("1");
  const FileVersions before = now();
  save("22");
  const FileVersions read = now();
  save("333");
  EXPECT_THROW(static_cast<void>(edited_files(before, read)), InputError);
}

TEST_F(EditedFilesTest, FileThatCannotBeReadIsRefusedWithReason) {
  save("1");
  const FileVersions before = now();
  fs::remove(file());
  fs::create_directory(file());
  EXPECT_THAT([&] { static_cast<void>(edited_files(before, now())); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("cannot be read: it is a folder")));
}

}  // namespace
}  // namespace doppel
