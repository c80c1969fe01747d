#include "doppel/twin/arms/detail/arm_worker.h"

#include <gmock/gmock.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <future>
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

TEST(ArmWorker, RequestBeyondTheirNumberIsRefused) {
  const Log log;
  std::promise<void> begun, open, emptied;
  ArmWorker worker(log);
  EXPECT_TRUE(worker.post([&] {
    begun.set_value();
    open.get_future().wait();
  }));
  begun.get_future().wait();  // It has left the queue, and the thread takes no other one.
  for (std::size_t i = 1; i < ArmWorker::kMaxWaiting; ++i) EXPECT_TRUE(worker.post([] {})) << i;
  EXPECT_TRUE(worker.post([&] { emptied.set_value(); }));
  bool is_done = false;
  EXPECT_FALSE(worker.post([&] { is_done = true; }));
  open.set_value();
  emptied.get_future().wait();
  EXPECT_FALSE(is_done) << "what was refused is not done";
  EXPECT_TRUE(worker.post([] {})) << "an empty queue takes requests again";
}

}  // namespace
}  // namespace doppel
