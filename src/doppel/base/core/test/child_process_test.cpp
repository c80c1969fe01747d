#include "doppel/base/core/child_process.h"

#include <gmock/gmock.h>
#include <linux/landlock.h>
#include <signal.h>
#include <sys/syscall.h>
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

// The pipe ends with the last process that has it.
TEST(ChildProcess, GroupOfEndedProgramGetsSignals) {
  ChildProcess child({.words = {"sh", "-c", "sleep 100 & exit 7"}, .output_piped = true});
  EXPECT_EQ(child.wait(), 7);
  EXPECT_FALSE(child.group_ended());
  child.signal(SIGTERM);
  EXPECT_EQ(read_until_end(child.output()), "");
}

TEST(ChildProcess, GroupOfEndedProgramEndsWithIt) {
  FileDescriptor output(-1);
  {
    ChildProcess child({.words = {"sh", "-c", "trap '' INT TERM; sleep 100 & exit 0"}, .output_piped = true});
    EXPECT_EQ(child.wait(), 0);
    output = FileDescriptor(dup(child.output()));
  }
  EXPECT_EQ(read_until_end(output.get()), "");
  ChildProcess alone({.words = {"true"}});
  alone.wait();
  EXPECT_TRUE(alone.group_ended());
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

// Programs of python3, confined.
class ConfinedChild : public testing::Test {
 protected:
  void SetUp() override {
    if (find_program(python_).empty()) GTEST_SKIP() << "python3 is not installed";
    try {
      ChildProcess({.words = {python_, "-c", ""}, .confined = true}).wait();
    } catch (const ConfinementError& error) {
      GTEST_SKIP() << "no filter of system calls: " << error.what();
    }
    folder_ = std::filesystem::path(::testing::TempDir()) / "confined";
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "read.txt") << "content";
  }
  std::string output(const std::string& program) const {
    ChildProcess child({.words = {python_, "-B", "-c", "import os, socket, signal\n" + program},
                        .folder = folder_,
                        .output_piped = true,
                        .confined = true});
    return read_until_end(child.output());
  }
  // The number of the error that an expression throws.
  std::string error(const std::string& expression) const {
    return output("try:\n  " + expression +
                  "\n  print('no error')\nexcept OSError as e:\n  print(e.errno)\n");
  }
  // A python3 in PATH may be a script, which starts another program.
  std::string python_ = is_program("/usr/bin/python3") ? "/usr/bin/python3" : "python3";
  std::filesystem::path folder_;
};

TEST_F(ConfinedChild, ReadsFilesAndFolders) {
  EXPECT_EQ(output("print(open('read.txt').read(), os.listdir('.'), os.path.getsize('read.txt'))"),
            "content ['read.txt'] 7\n");
  EXPECT_EQ(output("import threading\nt = threading.Thread(target=print, args=('in a thread',))\n"
                   "t.start(); t.join()"),
            "in a thread\n");
}

TEST_F(ConfinedChild, HasNoVariablesOfItsUser) {
  setenv("DOPPEL_TEST_PASSWORD", "secret", 1);
  EXPECT_EQ(output("print('DOPPEL_TEST_PASSWORD' in os.environ, 'PATH' in os.environ)"), "False True\n");
}

// /proc has the environment of each process of the same user, also that of the shell.
TEST_F(ConfinedChild, ReadsNoEnvironmentOfOtherProcess) {
  if (syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION) < 0)
    GTEST_SKIP() << "the kernel has no Landlock";
  for (const std::string file : {"environ", "mem"}) {
    const std::string of_parent = "/proc/" + std::to_string(getpid()) + "/" + file;
    EXPECT_EQ(error("open('" + of_parent + "', 'rb').read(1)"), "13\n") << file;
  }
  EXPECT_EQ(error("open('/proc/self/environ', 'rb').read(1)"), "no error\n");
}

TEST_F(ConfinedChild, ChangesNoFile) {
  for (const char* expression :
       {"open('new.txt', 'w')", "open('read.txt', 'a')", "open('read.txt', 'r+')", "os.remove('read.txt')",
        "os.rename('read.txt', 'b')", "os.mkdir('d')", "os.rmdir('.')", "os.symlink('read.txt', 'b')",
        "os.link('read.txt', 'b')", "os.chmod('read.txt', 0)", "os.truncate('read.txt', 0)", "os.mkfifo('b')",
        "os.utime('read.txt', (0, 0))", "os.setxattr('read.txt', 'user.a', b'b')",
        "os.open('.', os.O_TMPFILE | os.O_WRONLY)", "os.fchmod(os.open('read.txt', os.O_RDONLY), 0)",
        "os.chown('read.txt', 1, 1)"})
    EXPECT_EQ(error(expression), "1\n") << expression;
  EXPECT_EQ(error("import ctypes; n = ctypes.CDLL(None, use_errno=True).memfd_create(b'm', 0); "
                  "raise OSError(ctypes.get_errno(), '')"),
            "38\n");
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_)) ++files;
  EXPECT_EQ(files, 1);
  EXPECT_EQ(std::filesystem::file_size(folder_ / "read.txt"), 7);
}

TEST_F(ConfinedChild, StartsNothingAndReachesNobody) {
  const std::string parent = std::to_string(getpid());
  for (const std::string& expression :
       {std::string("os.execv('/bin/true', ['true'])"), std::string("os.fork()"),
        std::string("os.posix_spawn('/bin/true', ['true'], {})"),
        std::string("import subprocess; subprocess.run(['true'])"), std::string("socket.socket()"),
        std::string("socket.socketpair()"), "os.kill(" + parent + ", signal.SIGTERM)",
        std::string("os.kill(0, signal.SIGTERM)"), std::string("os.setsid()"),
        std::string("import fcntl; fcntl.fcntl(0, fcntl.F_SETOWN, " + parent + ")"),
        std::string("import fcntl; fcntl.flock(open('read.txt'), fcntl.LOCK_EX)"),
        std::string("import fcntl, termios; fcntl.ioctl(0, termios.TIOCSTI, b'x')")})
    EXPECT_EQ(error(expression), "1\n") << expression;
  EXPECT_EQ(output("import resource\ntry:\n  resource.setrlimit(resource.RLIMIT_CPU, (99, 99))\n"
                   "except (OSError, ValueError):\n  print('limited')"),
            "limited\n");
}

TEST_F(ConfinedChild, MemoryIsLimitedAndMissingProgramIsNamed) {
  EXPECT_EQ(output("try:\n  b = bytearray(1 << 36)\nexcept MemoryError:\n  print('too much')"), "too much\n");
  EXPECT_THROW(ChildProcess({.words = {"/nowhere/at_all"}, .confined = true}), std::system_error);
  EXPECT_THROW(ChildProcess({.words = {(folder_ / "read.txt").string()}, .confined = true}),
               std::system_error);
}

TEST_F(ConfinedChild, TalksThroughItsPipes) {
  ChildProcess child(
      {.words = {python_, "-c", "import os; print('lost'); os.write(3, b'got ' + os.read(4, 10))"},
       .converses = true,
       .confined = true});
  ASSERT_EQ(write(child.answers(), "yes\n", 4), 4);
  EXPECT_EQ(read_until_end(child.requests()), "got yes\n");
  EXPECT_EQ(child.wait(), 0);
}

}  // namespace
}  // namespace doppel
