// A file on a disk that is slow or fails while it is written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/test/system_faults.h"
#include "doppel/base/mcap/mcap_file_sink.h"
#include "doppel/base/mcap/test/memory_sink.h"

namespace doppel {
namespace {

using mcap_testing::bytes_of;
using namespace std::chrono_literals;

class McapFileSinkTest : public testing::Test {
 protected:
  McapFileSinkTest() { std::filesystem::remove(file_); }
  ~McapFileSinkTest() override { std::filesystem::remove(file_); }

  // The text of the failure; empty: there is none.
  static std::string failure_of_write(McapFileSink& sink) {
    try {
      sink.write(bytes_of("x"));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  const std::filesystem::path file_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string("file_sink_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".mcap");
};

TEST_F(McapFileSinkTest, SlowDiskDelaysNoWriteAndEndWaitsForIt) {
  const SlowDisk disk;
  auto sink = std::make_unique<McapFileSink>(file_.string());
  sink->write(bytes_of("one"));
  sink->start_sync();
  SlowDisk::wait_for_sync();
  sink->write(bytes_of("two"));
  sink->start_sync();
  auto end = std::async(std::launch::async, [&sink] { sink.reset(); });
  EXPECT_EQ(end.wait_for(20ms), std::future_status::timeout) << "the disk still uses the file";
  SlowDisk::release();
  end.get();
  EXPECT_EQ(SlowDisk::failed_syncs(), 0) << "the file was closed before its bytes were on the disk";
  EXPECT_EQ(std::filesystem::file_size(file_), 6U);
}

TEST_F(McapFileSinkTest, FailureOfDiskIsThatOfLaterWrites) {
  McapFileSink sink(file_.string());
  sink.write(bytes_of("one"));
  const FailingDisk disk(EIO);
  sink.start_sync();
  const auto end = std::chrono::steady_clock::now() + 60s;
  std::string failure;
  while (failure.empty() && std::chrono::steady_clock::now() < end) {
    failure = failure_of_write(sink);
    std::this_thread::yield();
  }
  EXPECT_THAT(failure, testing::HasSubstr("Input/output error"));
  const std::uintmax_t size = std::filesystem::file_size(file_);
  EXPECT_EQ(failure_of_write(sink), failure);
  EXPECT_EQ(std::filesystem::file_size(file_), size) << "nothing follows a failure";
}

}  // namespace
}  // namespace doppel
