// Pieces of work on several threads: each once, and the first failure is thrown.
#include "doppel/base/core/parallel_work.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace doppel {
namespace {

TEST(ParallelWork, EachPieceIsDoneOnceByAnyNumberOfThreads) {
  for (const std::size_t threads : {0U, 1U, 3U, 64U}) {
    std::vector<int> calls(50, 0);
    parallel_work(calls.size(), threads, [&] { return [&](std::size_t i) { ++calls[i]; }; });
    EXPECT_EQ(calls, std::vector<int>(50, 1)) << threads;
  }
  parallel_work(0, 4, [] { return [](std::size_t) { FAIL(); }; });
}

TEST(ParallelWork, FirstExceptionIsThrownAfterAllThreadsEnded) {
  std::atomic<int> running{0};
  const auto fail = [&] {
    parallel_work(1000, 4, [&] {
      return [&](std::size_t i) {
        ++running;
        --running;
        if (i == 10) throw std::runtime_error("piece 10");
      };
    });
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(running, 0);
}

}  // namespace
}  // namespace doppel
