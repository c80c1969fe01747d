// A folder that one process after another works on, also where one of them stands still.
#include "doppel/base/core/folder_lock.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>

#include <atomic>
#include <filesystem>
#include <future>
#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class FolderLockTest : public testing::Test {
 protected:
  FolderLockTest() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~FolderLockTest() override { std::filesystem::remove_all(folder_); }

  // A lock of another descriptor is as one of another process.
  [[nodiscard]] FileDescriptor locked_by_other() const {
    FileDescriptor out(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    EXPECT_EQ(flock(out.get(), LOCK_EX | LOCK_NB), 0);
    return out;
  }
  // The error, with what to do about it; empty: there is none.
  [[nodiscard]] std::string refusal(std::chrono::milliseconds lock_timeout) const {
    try {
      const FolderLock lock(folder_, lock_timeout);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string("folder_lock_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(FolderLockTest, LockThatOtherKeepsIsRefusedAfterItsTime) {
  const FileDescriptor other = locked_by_other();
  const std::string why = refusal(20ms);
  EXPECT_THAT(why, HasSubstr("the folder '" + folder_.string() + "' locked for 0.02 s"));
  EXPECT_THAT(why, HasSubstr("let it go on"));
  EXPECT_EQ(flock(other.get(), LOCK_UN), 0);
  EXPECT_EQ(refusal(0ms), "");
}

TEST_F(FolderLockTest, LockIsWaitedForUntilOtherHasEnded) {
  std::optional<FileDescriptor> other(locked_by_other());
  std::atomic<bool> has_it = false;
  auto waiting = std::async(std::launch::async, [&] {
    const FolderLock lock(folder_, 60s);
    has_it = true;
  });
  EXPECT_EQ(waiting.wait_for(20ms), std::future_status::timeout);
  EXPECT_FALSE(has_it);
  other.reset();  // as the end of a process does
  waiting.get();
  EXPECT_TRUE(has_it);
}

TEST_F(FolderLockTest, EndOfLockLetsNextOneIn) {
  { const FolderLock lock(folder_); }
  EXPECT_EQ(refusal(0ms), "");
  const FolderLock lock(folder_);
  EXPECT_THAT(refusal(0ms), HasSubstr("another process keeps"));
}

TEST_F(FolderLockTest, FolderThatIsMissingIsNotLocked) {
  std::filesystem::remove_all(folder_);
  EXPECT_EQ(refusal(0ms), "");
}

}  // namespace
}  // namespace doppel
