#include "doppel/base/core/child_process.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace doppel {
namespace {

std::string read_until_end(int fd) {
  std::string out;
  std::array<char, 256> part{};
  for (ssize_t n = 0; (n = read(fd, part.data(), part.size())) > 0;)
    out.append(part.data(), static_cast<std::size_t>(n));
  return out;
}

TEST(ChildProcess, OutputEnvironmentAndFolderAreThoseOfStart) {
  ChildProcess child({.words = {"sh", "-c", "pwd; echo $COLOUR; echo trouble >&2; cat; exit 3"},
                      .folder = "/",
                      .environment = {{"COLOUR", "red"}},
                      .output_piped = true});
  EXPECT_EQ(read_until_end(child.output()), "/\nred\ntrouble\n");
  EXPECT_EQ(child.wait(), 3);
  EXPECT_EQ(child.ended(), 3);
}

TEST(ChildProcess, ConversationGoesOverDescriptors) {
  ChildProcess child(
      {.words = {"sh", "-c", "echo question >&3; read answer <&4; echo got $answer >&3"}, .converses = true});
  ASSERT_EQ(write(child.answers(), "yes\n", 4), 4);
  EXPECT_EQ(child.wait(), 0);
  EXPECT_EQ(read_until_end(child.requests()), "question\ngot yes\n");
}

TEST(FindProgram, NamesAreSearchedInPathAndPathsAreNot) {
  EXPECT_EQ(find_program("sh").filename(), "sh");
  EXPECT_EQ(find_program("/bin/sh"), "/bin/sh");
  EXPECT_TRUE(find_program("no_such_program").empty());
  const std::filesystem::path text = std::filesystem::path(::testing::TempDir()) / "find_program.txt";
  std::ofstream(text) << "no program";
  EXPECT_TRUE(find_program(text.string()).empty()) << "it may not be executed";
  EXPECT_FALSE(is_program("/bin")) << "a folder";
}

TEST(ChildProcess, MissingProgramIsErrorWithItsName) {
  try {
    const ChildProcess child({.words = {"/nowhere/at_all"}});
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/nowhere/at_all"));
    EXPECT_EQ(error.code().value(), ENOENT);
  }
}

TEST(ChildProcess, SignalReachesGrandchildren) {
  ChildProcess child({.words = {"sh", "-c", "sleep 100 & echo $!; wait"}, .output_piped = true});
  std::array<char, 32> text{};
  ASSERT_GT(read(child.output(), text.data(), text.size() - 1), 0);
  const pid_t grandchild = static_cast<pid_t>(std::stol(text.data()));
  child.signal(SIGTERM);
  EXPECT_EQ(child.wait(), 128 + SIGTERM);
  for (int i = 0; i < 200 && kill(grandchild, 0) == 0; ++i) usleep(10'000);
  // In a container whose first process does not wait for orphans it stays as a zombie, which holds no pipe.
  EXPECT_EQ(read_until_end(child.output()), "");
}

TEST(ChildProcess, DescriptorsOfParentAreNotInherited) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  ChildProcess child({.words = {"sh", "-c", "ls /proc/self/fd | wc -l"}, .output_piped = true});
  // stdin, stdout, stderr, and the one with which ls reads the folder.
  EXPECT_EQ(std::stoi(read_until_end(child.output())), 4);
  close(ends[0]);
  close(ends[1]);
}

}  // namespace
}  // namespace doppel
