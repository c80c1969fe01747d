// The work of services beside the loop: what happens when too much of it waits.
#include "doppel/session/live/detail/background_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/session/live/validation_service.h"

namespace doppel {
namespace {

using testing::Each;
using testing::HasSubstr;

constexpr int kMaxWaitingWork = 16;
constexpr std::chrono::seconds kLongEnough{20};

// Work that has begun and waits until it may end.
struct HeldWork {
  void run() {
    if (!has_begun.exchange(true)) begun.set_value();
    may_end.wait();
  }
  [[nodiscard]] bool begins() {
    return begun.get_future().wait_for(kLongEnough) == std::future_status::ready;
  }

  std::atomic<bool> has_begun{false};
  std::promise<void> begun, end;
  std::shared_future<void> may_end = end.get_future().share();
};

TEST(BackgroundQueue, SeventeenthThatWaitsIsRefusedAndOthersRun) {
  const auto held = std::make_shared<HeldWork>();
  const auto ran = std::make_shared<std::atomic<int>>(0);
  BackgroundQueue queue;
  ASSERT_TRUE(queue.post([held] { held->run(); }));
  ASSERT_TRUE(held->begins());
  for (int i = 0; i < kMaxWaitingWork; ++i) EXPECT_TRUE(queue.post([ran] { ++*ran; })) << i;
  EXPECT_FALSE(queue.post([ran] { ++*ran; }));
  held->end.set_value();
  const auto count = std::make_shared<std::promise<int>>();
  std::future<int> counted = count->get_future();
  const auto end = std::chrono::steady_clock::now() + kLongEnough;
  while (!queue.post([ran, count] { count->set_value(ran->load()); })) {
    ASSERT_LT(std::chrono::steady_clock::now(), end) << "expected work to be accepted again";
    std::this_thread::yield();
  }
  ASSERT_EQ(counted.wait_for(kLongEnough), std::future_status::ready);
  EXPECT_EQ(counted.get(), kMaxWaitingWork);
}

TEST(BackgroundQueue, ServiceAnswersRequestBeyondItWithReason) {
  using doppel_msgs::srv::ListChecks;
  const auto held = std::make_shared<HeldWork>();
  Bus bus;
  ValidationServiceOptions options;
  options.load = [held]() -> std::shared_ptr<ValidationWork> {
    held->run();
    throw InputError("validate.missing", {}, "there is no suite");
  };
  const ValidationService service(bus, options);
  const auto edge = bus.attach("edge");
  std::vector<std::string> answers;
  const auto ask = [&] {
    edge->call("/doppel/validate/checks", to_cdr(ListChecks::Request{}),
               [&answers](const Status& status, const Bytes& cdr) {
                 ListChecks::Response response;
                 EXPECT_TRUE(status) << status.why();
                 EXPECT_TRUE(from_cdr(cdr, response));
                 answers.emplace_back(response.message);
               });
  };
  const auto until_answered = [&](std::size_t number) {
    const auto end = std::chrono::steady_clock::now() + kLongEnough;
    while (answers.size() < number && std::chrono::steady_clock::now() < end) {
      bus.wait(std::chrono::milliseconds(20));
      bus.spin();
    }
    return answers.size() == number;
  };
  ask();
  bus.spin();
  ASSERT_TRUE(held->begins());
  for (int i = 0; i <= kMaxWaitingWork; ++i) ask();
  EXPECT_TRUE(until_answered(1));
  EXPECT_THAT(answers, Each(HasSubstr("too many requests are waiting: ask again")));
  answers.clear();
  held->end.set_value();
  EXPECT_TRUE(until_answered(kMaxWaitingWork + 1));
  ask();
  EXPECT_TRUE(until_answered(kMaxWaitingWork + 2)) << "expected requests to be accepted again";
  EXPECT_THAT(answers, Each(HasSubstr("there is no suite")));
}

}  // namespace
}  // namespace doppel
