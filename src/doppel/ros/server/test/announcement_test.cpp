#include "doppel/ros/server/announcement.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/core/log.h"
#include "doppel/ros/server/server.h"

namespace doppel {
namespace {

class AnnouncementTest : public ::testing::Test {
 protected:
  AnnouncementTest() {
    char name[] = "/tmp/doppel_test_XXXXXX";
    folder_ = mkdtemp(name);
    setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1);
  }
  ~AnnouncementTest() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
  Log log_;
  Bus bus_;
};

TEST_F(AnnouncementTest, AnnouncementIsFoundWhileRunning) {
  const Server server(bus_, {.port = 0}, log_);
  {
    const Announcement announcement("arm \"one\"", server.port());
    EXPECT_EQ(announcement.problem(), "");
    const auto twins = find_running();
    ASSERT_EQ(twins.size(), 1u);
    EXPECT_EQ(twins[0].robot, "arm \"one\"");
    EXPECT_EQ(twins[0].port, server.port());
    EXPECT_EQ(twins[0].pid, getpid());
    EXPECT_EQ(std::filesystem::status(announcement_folder()).permissions(),
              std::filesystem::perms::owner_all);
  }
  EXPECT_TRUE(find_running().empty());
}

TEST_F(AnnouncementTest, FullDiskIsReportedWithoutLeftovers) {
  const auto before = signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit full{.rlim_cur = 0, .rlim_max = limit.rlim_max};
  setrlimit(RLIMIT_FSIZE, &full);
  const Announcement announcement("arm", 8700);
  setrlimit(RLIMIT_FSIZE, &limit);
  signal(SIGXFSZ, before);
  EXPECT_NE(announcement.problem().find("File too large"), std::string::npos) << announcement.problem();
  EXPECT_TRUE(std::filesystem::is_empty(announcement_folder()));
}

TEST_F(AnnouncementTest, NewestIsListedFirst) {
  const Server first(bus_, {.port = 0}, log_), second(bus_, {.port = 0}, log_);
  const Announcement older("first", first.port()), newer("second", second.port());
  const auto twins = find_running();
  ASSERT_EQ(twins.size(), 2u);
  EXPECT_EQ(twins[0].robot, "second");
}

TEST_F(AnnouncementTest, NameOfRunningTwinInDomainIsRefused) {
  const Server first(bus_, {.port = 0}, log_), second(bus_, {.port = 0}, log_);
  Announcement left("left", first.port()), right("right", second.port());
  EXPECT_FALSE(left.enter_domain(7, {"/controller_manager", "/doppel"}));
  EXPECT_FALSE(right.enter_domain(8, {"/controller_manager"})) << "expected no conflict between domains";
  EXPECT_FALSE(right.enter_domain(7, {"/right/controller_manager"})) << "expected no conflict between names";
  const auto conflict = right.enter_domain(7, {"/right/doppel", "/doppel"});
  ASSERT_TRUE(conflict);
  EXPECT_EQ(conflict->label(), "left (port " + std::to_string(first.port()) + ")");
  EXPECT_FALSE(left.enter_domain(7, {"/controller_manager"})) << "expected no conflict with itself";
  const auto twins = find_running();
  ASSERT_EQ(twins.size(), 2u);
  EXPECT_EQ(twins[0].domain, 7u);
  EXPECT_EQ(twins[0].nodes, std::vector<std::string>{"/right/controller_manager"});
}

// A process that stands still has the lock, as after Ctrl-Z.
TEST_F(AnnouncementTest, FolderThatStaysLockedDoesNotStopTwin) {
  constexpr std::chrono::milliseconds kLockTimeout{20};
  const Server first(bus_, {.port = 0}, log_), second(bus_, {.port = 0}, log_);
  Announcement left("left", first.port()), right("right", second.port());
  EXPECT_FALSE(left.enter_domain(7, {"/doppel"}));
  EXPECT_EQ(left.problem(), "");
  const FileDescriptor folder(::open(announcement_folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(flock(folder.get(), LOCK_EX), 0);
  const auto conflict = right.enter_domain(7, {"/doppel"}, kLockTimeout);
  ASSERT_TRUE(conflict) << "expected the names of running twins to be compared";
  EXPECT_EQ(conflict->robot, "left");
  EXPECT_FALSE(right.enter_domain(7, {"/right/doppel"}, kLockTimeout));
  EXPECT_NE(right.problem().find("'" + announcement_folder().string() + "' locked"), std::string::npos)
      << right.problem();
  const auto twins = find_running();
  ASSERT_EQ(twins.size(), 2u);
  EXPECT_EQ(twins[0].nodes, std::vector<std::string>{"/right/doppel"});
}

TEST_F(AnnouncementTest, TwinOfThousandRobotsIsFound) {
  const Server server(bus_, {.port = 0}, log_);
  Announcement many("many", server.port());
  std::vector<std::string> nodes;
  for (int i = 0; i < 5000; ++i) nodes.push_back("/robot_" + std::to_string(i) + "/controller_manager");
  EXPECT_FALSE(many.enter_domain(7, nodes));
  ASSERT_EQ(find_running().size(), 1u);
  EXPECT_EQ(find_running()[0].nodes, nodes);
}

TEST_F(AnnouncementTest, TooLargeOneIsReportedAndTwinIsStillFound) {
  const Server server(bus_, {.port = 0}, log_);
  Announcement many("many", server.port());
  const std::vector<std::string> nodes(50, "/" + std::string(100'000, 'x'));
  EXPECT_FALSE(many.enter_domain(7, nodes));
  EXPECT_NE(many.problem().find("50 nodes, is larger than 4 MB"), std::string::npos) << many.problem();
  const auto twins = find_running();
  ASSERT_EQ(twins.size(), 1u);
  EXPECT_EQ(twins[0].robot, "many");
  EXPECT_TRUE(twins[0].nodes.empty());
}

TEST_F(AnnouncementTest, EmulatedArmIsMarked) {
  const Server server(bus_, {.port = 0}, log_);
  Announcement arm("arm", server.port());
  arm.mark_emulated();
  const auto twins = find_running();
  ASSERT_EQ(twins.size(), 1u);
  EXPECT_TRUE(twins[0].emulated);
  EXPECT_EQ(twins[0].domain, std::nullopt);
  EXPECT_EQ(twins[0].label(), "arm, emulated (port " + std::to_string(server.port()) + ")");
}

TEST_F(AnnouncementTest, EndedTwinIsIgnoredAndRemoved) {
  std::uint16_t closed_port = 0;
  {
    const Server server(bus_, {.port = 0}, log_);
    closed_port = server.port();
  }
  const Announcement ended("ended", closed_port);
  std::ofstream(announcement_folder() / "1-2.json") << "{broken";
  std::ofstream(announcement_folder() / "3-4.json") << R"({"pid":"x","port":1,"robot":"r","started":1})";
  EXPECT_TRUE(find_running().empty());
  EXPECT_TRUE(std::filesystem::is_empty(announcement_folder()));
}

TEST_F(AnnouncementTest, FolderWritableByOthersIsRefused) {
  std::filesystem::create_directory(folder_ / "doppel");
  chmod((folder_ / "doppel").c_str(), 0777);
  const Announcement announcement("arm", 1);
  EXPECT_NE(announcement.problem(), "");
}

}  // namespace
}  // namespace doppel
