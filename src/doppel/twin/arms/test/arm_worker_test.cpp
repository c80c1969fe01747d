#include "doppel/twin/arms/detail/arm_worker.h"

#include <gmock/gmock.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <new>

namespace doppel {
namespace {

TEST(ArmWorker, ExceptionEndsOneRequestAlone) {
  std::mutex mutex;
  std::condition_variable changed;
  bool answered = false;
  std::string logged;
  Log log;
  log.add_sink([&](const LogLine& line) { logged += line.text; });
  {
    ArmWorker worker(log);
    ASSERT_TRUE(worker.post([] { throw std::bad_alloc(); }));
    ASSERT_TRUE(worker.post([&] {
      const std::lock_guard lock(mutex);
      answered = true;
      changed.notify_all();
    }));
    std::unique_lock lock(mutex);
    EXPECT_TRUE(changed.wait_for(lock, std::chrono::seconds(60), [&] { return answered; }));
  }
  EXPECT_THAT(logged, testing::HasSubstr("there is not enough memory"));
}

}  // namespace
}  // namespace doppel
