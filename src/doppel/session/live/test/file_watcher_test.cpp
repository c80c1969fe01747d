// Folders that are moved, removed and made again: the events that the kernel reports, and those it does not.
#include "doppel/session/live/file_watcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr milliseconds kQuiet{20};

class FileWatcherTest : public ::testing::Test {
 protected:
  FileWatcherTest() {
    char name[] = "/tmp/doppel_watch_XXXXXX";
    folder_ = fs::canonical(mkdtemp(name));
    fs::create_directories(folder_ / "robot/urdf");
    save("robot/urdf/arm.xacro", "1");
    watcher_.watch({file()});
  }
  ~FileWatcherTest() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path file() const { return folder_ / "robot/urdf/arm.xacro"; }
  void save(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  // The next changes; empty after ten seconds.
  std::vector<fs::path> next() { return watcher_.wait(kQuiet, seconds(10)); }
  // Takes the changes that are reported already.
  void settle() {
    while (!watcher_.wait(kQuiet, milliseconds(50)).empty()) {
    }
  }

  fs::path folder_;
  FileWatcher watcher_;
};

TEST_F(FileWatcherTest, FolderMadeAgainIsWatched) {
  fs::remove_all(folder_ / "robot/urdf");
  settle();
  fs::create_directories(folder_ / "robot/urdf");
  save("robot/urdf/arm.xacro", "2");
  EXPECT_THAT(next(), ElementsAre(file()));
  settle();
  save("robot/urdf/arm.xacro", "3");
  EXPECT_THAT(next(), ElementsAre(file()));
}

TEST_F(FileWatcherTest, FolderAboveMovedAndReplacedIsWatched) {
  fs::rename(folder_ / "robot", folder_ / "old");
  settle();
  fs::copy(folder_ / "old", folder_ / "robot", fs::copy_options::recursive);
  EXPECT_THAT(next(), ElementsAre(file()));
  settle();
  save("old/urdf/arm.xacro", "of the moved folder");
  EXPECT_THAT(watcher_.wait(kQuiet, milliseconds(100)), IsEmpty());
  save("robot/urdf/arm.xacro", "3");
  EXPECT_THAT(next(), ElementsAre(file()));
}

TEST_F(FileWatcherTest, FileInFoldersThatDoNotExistYetIsWatched) {
  const fs::path late = folder_ / "a/b/c/late.xacro";
  watcher_.watch({file(), late});
  fs::create_directories(late.parent_path());
  save("a/b/c/late.xacro", "1");
  EXPECT_THAT(next(), ElementsAre(late));
}

// A deployment, GNU stow, nix and ConfigMaps of Kubernetes save by pointing a link at another folder.
TEST_F(FileWatcherTest, FolderLinkWithAnotherTargetIsReported) {
  fs::create_directories(folder_ / "releases");
  fs::copy(folder_ / "robot", folder_ / "releases/v1", fs::copy_options::recursive);
  fs::copy(folder_ / "robot", folder_ / "releases/v2", fs::copy_options::recursive);
  fs::create_symlink("releases/v1", folder_ / "latest");
  fs::create_symlink(folder_ / "latest", folder_ / "current");
  const fs::path linked = folder_ / "current/urdf/arm.xacro";
  watcher_.watch({linked});
  const auto point = [this](const char* link, const char* target) {
    fs::create_symlink(target, folder_ / "fresh");
    fs::rename(folder_ / "fresh", folder_ / link);
  };
  point("latest", "releases/v2");
  EXPECT_THAT(next(), ElementsAre(linked));
  settle();
  save("releases/v2/urdf/arm.xacro", "2");
  EXPECT_THAT(next(), ElementsAre(linked));
  settle();
  fs::remove(folder_ / "current");
  settle();
  fs::create_symlink("releases/v1", folder_ / "current");
  EXPECT_THAT(next(), ElementsAre(linked));
  settle();
  save("releases/v1/urdf/arm.xacro", "3");
  EXPECT_THAT(next(), ElementsAre(linked));
}

// link() and symlink() make a whole file, which no process closes.
TEST_F(FileWatcherTest, FileMadeByLinkIsReported) {
  save("2", "2");
  fs::remove(file());
  settle();
  fs::create_hard_link(folder_ / "2", file());
  EXPECT_THAT(next(), ElementsAre(file()));
  fs::remove(file());
  settle();
  fs::create_symlink(folder_ / "2", file());
  EXPECT_THAT(next(), ElementsAre(file()));
  settle();
  save("2", "33");
  EXPECT_THAT(next(), ElementsAre(file()));
}

TEST_F(FileWatcherTest, LinksInCircleAreNoFile) {
  fs::create_symlink("b", folder_ / "a");
  fs::create_symlink("a", folder_ / "b");
  watcher_.watch({folder_ / "a/arm.xacro", file()});
  save("robot/urdf/arm.xacro", "2");
  EXPECT_THAT(next(), ElementsAre(file()));
}

TEST_F(FileWatcherTest, BusyNeighbourDoesNotDelayReport) {
  std::atomic<bool> ends{false};
  std::thread neighbour([&] {
    while (!ends) {
      save("robot/urdf/some.log", "x");
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  save("robot/urdf/arm.xacro", "2");
  EXPECT_THAT(next(), ElementsAre(file()));
  ends = true;
  neighbour.join();
}

TEST_F(FileWatcherTest, FileWrittenContinuouslyIsReported) {
  std::atomic<bool> ends{false};
  std::thread writer([&] {
    while (!ends) {
      save("robot/urdf/arm.xacro", "x");
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  EXPECT_THAT(next(), ElementsAre(file()));
  ends = true;
  writer.join();
}

// 16384 events at most wait by default (/proc/sys/fs/inotify/max_queued_events); those beyond are lost.
TEST_F(FileWatcherTest, ChangeLostInFullQueueIsFound) {
  for (int i = 0; i < 20'000; ++i) save(i % 2 == 0 ? "robot/urdf/a" : "robot/urdf/b", "");
  save("robot/urdf/arm.xacro", "22");
  EXPECT_THAT(next(), ElementsAre(file()));
}

TEST_F(FileWatcherTest, FilesThatWereReadAreWatchedUntilNextSet) {
  const auto read = std::make_shared<FilesRead>();
  const fs::path included = folder_ / "robot/urdf/new.xacro";
  watcher_.watch_read(read);
  {
    const FilesRead::Recording recording(*read);
    FilesRead::note(included);
  }
  EXPECT_THAT(watcher_.wait(kQuiet, milliseconds(1)), IsEmpty());
  save("robot/urdf/new.xacro", "1");
  EXPECT_THAT(next(), ElementsAre(included));
  watcher_.watch({file()});
  save("robot/urdf/new.xacro", "2");
  EXPECT_THAT(watcher_.wait(kQuiet, milliseconds(100)), IsEmpty());
}

TEST_F(FileWatcherTest, ChangeSinceFileWasReadIsReported) {
  const auto read = std::make_shared<FilesRead>();
  // In folders that are not watched yet, so that the kernel has no event of them.
  const fs::path included = folder_ / "parts/new.xacro", second = folder_ / "others/second.xacro";
  watcher_.watch_read(read);
  for (const fs::path& path : {included, second}) {
    fs::create_directories(path.parent_path());
    save(fs::relative(path, folder_), "1");
  }
  const auto note_and_change = [&](const fs::path& path) {
    const FilesRead::Recording recording(*read);
    FilesRead::note(path);
    save(fs::relative(path, folder_), "22");
  };
  note_and_change(included);  // by a build that fails
  EXPECT_THAT(next(), ElementsAre(included));
  note_and_change(second);  // by one that is applied
  watcher_.watch({file(), second});
  EXPECT_THAT(next(), ElementsAre(second));
}

TEST_F(FileWatcherTest, StopEndsWait) {
  std::thread stopper([this] { watcher_.stop(); });
  EXPECT_THAT(watcher_.wait(kQuiet), IsEmpty());
  stopper.join();
}

}  // namespace
}  // namespace doppel
