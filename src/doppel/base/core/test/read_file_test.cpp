// The one reader of files that others wrote.
#include "doppel/base/core/read_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <vector>

#include "doppel/base/core/allowed_pipes.h"
#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

using testing::HasSubstr;

class ReadFileTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / "read_file" / info->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  static std::string error_of(const fs::path& file, std::size_t max_bytes = 100) {
    try {
      (void)read_file(file.string(), max_bytes);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

TEST_F(ReadFileTest, FileUpToBoundIsRead) {
  const fs::path file = write("a", "12345");
  EXPECT_EQ(read_file(file.string(), 5), "12345");
  EXPECT_EQ(read_content(file, 5).bytes, "12345");
  EXPECT_EQ(beginning_of_file(file, 3), "123");
  EXPECT_EQ(beginning_of_file(file, 9), "12345");
  EXPECT_EQ(read_file(write("empty", "").string(), 0), "");
}

// A description that includes /dev/stdin would wait for the input of the program.
TEST_F(ReadFileTest, PipeIsReadWhereCommandLineNamesIt) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const std::string name = "/dev/fd/" + std::to_string(ends[0]);
  ASSERT_EQ(::write(ends[1], "12345", 5), 5);
  close(ends[1]);
  EXPECT_THAT(error_of(name), HasSubstr("it is not a regular file"));
  const std::vector<std::string> arguments = {"up", "arm.urdf", "--world=" + name, "/dev/null"};
  allow_pipes(arguments);
  EXPECT_EQ(read_content(name, 5).bytes, "12345");
  EXPECT_EQ(read_content(name, 5).bytes, "12345") << "expected the same at a reload";
  EXPECT_THAT(error_of("/dev/null"), HasSubstr("it is not a regular file"));
  close(ends[0]);
}

TEST_F(ReadFileTest, FileBeyondBoundIsRefusedWithBoth) {
  const fs::path file = write("a", "12345");
  EXPECT_THAT(error_of(file, 4),
              AllOf(HasSubstr("a' cannot be read"), HasSubstr("it is larger than 4 bytes")));
  fs::resize_file(file, (std::size_t{2} << 20) + 1);
  EXPECT_THAT(error_of(file, std::size_t{2} << 20), HasSubstr("it is larger than 2 MB"));
  EXPECT_EQ(read_content(file, 4).bytes, "");
}

// Each file of a stranger's package may be one of these; a reader without a bound waits, or takes all memory.
TEST_F(ReadFileTest, WhatIsNoRegularFileIsRefused) {
  const fs::path pipe = folder_ / "pipe", device = folder_ / "device", gone = folder_ / "gone";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", device);
  for (const fs::path& file : {pipe, device}) {
    EXPECT_THAT(error_of(file), HasSubstr("it is not a regular file")) << file;
    EXPECT_EQ(beginning_of_file(file, 10), "") << file;
    EXPECT_FALSE(read_content(file, 10).is_missing) << file;
  }
  EXPECT_THAT(error_of(folder_), HasSubstr("it is a folder"));
  EXPECT_THAT(error_of(gone), HasSubstr("No such file or directory"));
  EXPECT_TRUE(read_content(gone, 10).is_missing);
}

}  // namespace
}  // namespace doppel
