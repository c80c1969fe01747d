// The main function of every test program: that of gtest, with a folder for files that no other process
// shares, because ctest runs the tests of one program as parallel processes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  std::string folder = testing::TempDir() + "doppel_test.XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) {
    std::perror("error: cannot make a folder for the files of the tests");
    return 1;
  }
  setenv("TEST_TMPDIR", (folder + "/").c_str(), 1);
  const int failed = RUN_ALL_TESTS();
  std::error_code none;
  std::filesystem::remove_all(folder, none);
  return failed;
}
