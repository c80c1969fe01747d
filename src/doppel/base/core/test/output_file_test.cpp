#include "doppel/base/core/output_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

TEST(OutputFileTest, FailedWriteLeavesOldFile) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "doppel_output_file";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  write_whole(folder / "a", "one");
  write_whole(folder / "a", "two");
  std::string text;
  std::ifstream(folder / "a") >> text;
  EXPECT_EQ(text, "two");
  const auto refused = [](const std::filesystem::path& file) {
    try {
      write_whole(file, "x");
    } catch (const InputError& error) {
      return error.diagnostics().front();
    }
    return Diagnostic{};
  };
  EXPECT_EQ(refused(folder / "missing" / "a").rule, "output.unwritable");
  EXPECT_NE(refused(folder / "missing" / "a").fix.find("missing"), std::string::npos);
  EXPECT_EQ(refused(folder).rule, "output.unwritable");
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_NE(refused("/dev/full").message.find("No space"), std::string::npos);
  }
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++files;
  EXPECT_EQ(files, 1u) << "expected no temporary files to be left";
  std::filesystem::create_symlink(folder / "a", folder / "link");
  write_whole(folder / "link", "three");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  std::ifstream(folder / "a") >> text;
  EXPECT_EQ(text, "three");
}

TEST(OutputFileTest, PlaceThatCannotBeWrittenIsRefusedBeforehand) {
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("doppel_unwritable_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  write_whole(folder / "a", "old");
  const auto said = [](const std::filesystem::path& file) {
    try {
      check_writable(file);
    } catch (const InputError& error) {
      return error.diagnostics().front().message + ": " + error.diagnostics().front().fix;
    }
    return std::string();
  };
  EXPECT_EQ(said(folder / "a"), "");
  EXPECT_EQ(said(folder / "new"), "");
  EXPECT_EQ(said("/dev/null"), "");
  EXPECT_NE(said(folder).find("give the path of a file"), std::string::npos) << said(folder);
  EXPECT_NE(said(folder / "missing" / "b").find("create the folder"), std::string::npos);
  EXPECT_NE(said(folder / "a" / "b").find("Not a directory"), std::string::npos) << said(folder / "a" / "b");
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++files;
  EXPECT_EQ(files, 1U) << "nothing is made";
  std::filesystem::remove_all(folder);
}

TEST(OutputFileTest, LinkToMissingFileIsWrittenAndCircleIsRefused) {
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("doppel_output_links_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::filesystem::create_symlink("new", folder / "dangling");
  std::filesystem::create_symlink("circle", folder / "circle");
  std::filesystem::create_symlink("missing/new", folder / "lost");
  check_writable(folder / "dangling");
  write_whole(folder / "dangling", "one");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "dangling"));
  std::string text;
  std::ifstream(folder / "new") >> text;
  EXPECT_EQ(text, "one");
  const auto fix = [](auto write, const std::filesystem::path& file) {
    try {
      write(file);
    } catch (const InputError& error) {
      return error.diagnostics().front().fix;
    }
    return std::string();
  };
  const auto write = [](const std::filesystem::path& file) { write_whole(file, "x"); };
  EXPECT_NE(fix(check_writable, folder / "circle").find("in a circle"), std::string::npos);
  EXPECT_NE(fix(write, folder / "circle").find("in a circle"), std::string::npos);
  EXPECT_NE(fix(check_writable, folder / "lost").find("missing' first"), std::string::npos);
  EXPECT_NE(fix(write, folder / "lost").find("missing' first"), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST(OutputFileTest, LongestNameIsWrittenAndLongerOneRefusedBeforehand) {
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("doppel_output_names_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  check_writable(folder / std::string(255, 'a'));
  write_whole(folder / std::string(255, 'a'), "x");
  EXPECT_TRUE(std::filesystem::exists(folder / std::string(255, 'a')));
  try {
    check_writable(folder / std::string(256, 'a'));
    ADD_FAILURE() << "a name of 256 bytes is accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics().front().fix, "choose a shorter name");
  }
  std::filesystem::remove_all(folder);
}

// The limit on the size of a file ends the child in the middle of its writing, by a signal.
TEST(OutputFileTest, ProcessKilledWhileWritingLeavesOldFileAndNoOther) {
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("doppel_killed_writer_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  write_whole(folder / "a", "old");
  const pid_t child = fork();
  if (child == 0) {
    const rlimit none{0, 0}, most{1000, 1000};
    setrlimit(RLIMIT_CORE, &none);
    setrlimit(RLIMIT_FSIZE, &most);
    write_whole(folder / "a", std::string(100'000, 'x'));
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGXFSZ);
  std::string text;
  std::ifstream(folder / "a") >> text;
  EXPECT_EQ(text, "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace doppel
