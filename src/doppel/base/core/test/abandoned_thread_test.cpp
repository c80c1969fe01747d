// Work that may never end.
#include "doppel/base/core/abandoned_thread.h"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>

namespace doppel {
namespace {

using namespace std::chrono_literals;
constexpr auto kLong = 10s;

void ignore(const std::string&) {}

TEST(AbandonableWork, WithoutWorkNothingIsUnfinished) {
  AbandonableWork work;
  EXPECT_TRUE(work.wait_for(0ms));
  EXPECT_EQ(work.unfinished(), 0);
  work.abandon();
}

TEST(AbandonableWork, EndedWorkDoesNotCountAsUnfinishedInWhatFollows) {
  AbandonableWork work;
  std::promise<int> unfinished;
  work.start([] {}, [&] { unfinished.set_value(work.unfinished()); }, ignore);
  EXPECT_EQ(unfinished.get_future().get(), 0);
  EXPECT_TRUE(work.wait_for(kLong));
}

TEST(AbandonableWork, AbandonedWorkContinuesAndIsCountedUntilItEnds) {
  const auto release = std::make_shared<std::promise<void>>();
  const auto ended = std::make_shared<std::promise<void>>();
  AbandonableWork work;
  work.start([release] { release->get_future().wait(); }, [ended] { ended->set_value(); }, ignore);
  EXPECT_FALSE(work.wait_for(0ms));
  bool second = false;
  work.start([&] { second = true; }, {}, ignore);
  EXPECT_TRUE(work.wait_for(kLong));
  EXPECT_TRUE(second);
  EXPECT_EQ(work.unfinished(), 1);
  EXPECT_TRUE(has_abandoned_thread());
  release->set_value();
  ended->get_future().wait();
  EXPECT_EQ(work.unfinished(), 0);
}

TEST(AbandonableWork, ExceptionEndsWorkAndIsReported) {
  AbandonableWork work;
  std::promise<std::string> reported;
  bool followed = false;
  work.start([] { throw std::runtime_error("no disk"); }, [&] { followed = true; },
             [&](const std::string& what) { reported.set_value(what); });
  EXPECT_NE(reported.get_future().get().find("no disk"), std::string::npos);
  EXPECT_TRUE(work.wait_for(kLong));
  EXPECT_EQ(work.unfinished(), 0);
  work.abandon();
  EXPECT_FALSE(followed);
}

}  // namespace
}  // namespace doppel
